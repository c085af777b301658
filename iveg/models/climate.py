"""The air in the greenhouse, live and remembered."""

from pydantic import Field

from iveg.domain.observations import Climate as DomainClimate
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, rounded


class Air(Model):
    """Measured climate; null where a sensor is silent."""

    temperature: float | None = Field(description="°C.")
    relative_humidity: float | None = Field(description="0 to 1.")
    co2: float | None = Field(description="ppm.")


class Climate(Air):
    """The newest reading."""

    received_at: str
    age_s: float

    @classmethod
    def of(cls, read: DomainClimate, received: Instant, now: Instant) -> "Climate":
        """As it came in."""
        return cls(
            temperature=read.temperature,
            relative_humidity=read.relative_humidity,
            co2=read.co2,
            received_at=format_stamp(received.wall),
            age_s=round(now.mono - received.mono, 3),
        )


class ClimateReading(Air):
    """One reading of the past, or the mean of a slice of time."""

    at: str

    @classmethod
    def of_series(
        cls,
        at: float,
        temperature: float | None,
        relative_humidity: float | None,
        co2: float | None,
    ) -> "ClimateReading":
        """With no more decimals than sensors mean; ``at`` in Unix seconds."""
        return cls(
            at=format_stamp(at),
            temperature=rounded(temperature, 2),
            relative_humidity=rounded(relative_humidity, 4),
            co2=rounded(co2, 1),
        )
