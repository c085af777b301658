"""The air in the greenhouse and its other equipment, live and remembered."""

from typing import Self

from pydantic import Field

from iveg.domain.equipment import Limit, State, TileStatus
from iveg.domain.equipment import Tile as DomainTile
from iveg.domain.observations import Climate as DomainClimate
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, Stamp, Thousandth, rounded


class Air(Model):
    """Measured climate; null where a sensor is silent."""

    temperature: float | None = Field(description="°C.")
    relative_humidity: float | None = Field(description="0 to 1.")
    co2: float | None = Field(description="ppm.")


class Climate(Air):
    """The newest reading.

    Attributes:
        received_at: When iVeg took it.
        age_s: Since then (s).
    """

    received_at: Stamp
    age_s: Thousandth

    @classmethod
    def of(cls, read: DomainClimate, received: Instant, now: Instant) -> Self:
        """As it came in."""
        return cls.from_value(
            read, received_at=received, age_s=now.mono - received.mono
        )


class ClimateReading(Air):
    """One reading of the past, or the mean of a slice of time.

    Attributes:
        at: When.
    """

    at: Stamp

    @classmethod
    def of_series(
        cls,
        at: float,
        temperature: float | None,
        relative_humidity: float | None,
        co2: float | None,
    ) -> Self:
        """With no more decimals than sensors mean; ``at`` in Unix seconds."""
        return cls(
            at=format_stamp(at),
            temperature=rounded(temperature, 2),
            relative_humidity=rounded(relative_humidity, 4),
            co2=rounded(co2, 1),
        )


class TileName(Model):
    """What people call it, by language.

    Attributes:
        es: By language.
        en: By language.
    """

    es: str
    en: str


class TilePlace(Model):
    """Where its mark stands in ``map`` (m).

    Attributes:
        x: In ``map`` (m).
        y: In ``map`` (m).
    """

    x: float
    y: float


class Tile(Model):
    """One attribute of one entity, with its newest number.

    Attributes:
        entity_id: The entity at Orion.
        attribute: Its attribute.
        name: What people call it.
        unit: Of ``value`` and ``limits``; ``1``: none.
        decimals: That people are shown.
        limits: ``low_low``, ``low``, ``high``, ``high_high``, those that it has (its
            unit).
        state: [equipment.md](../equipment.md), "States".
        received_at: When iVeg took it.
        age_s: Since then (s).
        trend: Its last 24 hours are drawn.
        place: Of its mark on the map.
    """

    key: str = Field(description="Entity and attribute.")
    entity_id: str
    attribute: str
    name: TileName
    unit: str
    decimals: int
    limits: dict[Limit, float]
    state: State
    value: float | None = Field(description="The newest number; null before the first.")
    received_at: Stamp | None
    age_s: Thousandth | None
    trend: bool
    place: TilePlace | None

    @classmethod
    def of(
        cls, tile: DomainTile, status: TileStatus, state: State, now: Instant
    ) -> Self:
        """As it stands now."""
        received, place = status.received, tile.place
        return cls.from_value(
            tile,
            name=TileName(**tile.name),
            state=state,
            value=status.value,
            received_at=received,
            age_s=None if received is None else now.mono - received.mono,
            trend=tile.has_trend,
            place=None if place is None else TilePlace(x=place[0], y=place[1]),
        )
