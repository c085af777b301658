"""Other equipment of the greenhouse: its tiles, live and remembered.

The air in the greenhouse, live and remembered.
"""

from dataclasses import asdict

from pydantic import Field

from iveg.domain.equipment import Limit, State, TileStatus
from iveg.domain.equipment import Tile as DomainTile
from iveg.domain.observations import Climate as DomainClimate
from iveg.domain.observations import Instant
from iveg.domain.records import MeasurementRecord
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, moment, rounded


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
    """One reading of the past, or the mean of a slice of time.

    Attributes:
        at: When.
    """

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

    @classmethod
    def of(cls, x: float, y: float) -> "TilePlace":
        """As the file says (m)."""
        return cls(x=x, y=y)


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
    received_at: str | None
    age_s: float | None
    trend: bool
    place: TilePlace | None

    @classmethod
    def of(
        cls, tile: DomainTile, status: TileStatus, state: State, now: Instant
    ) -> "Tile":
        """As it stands now."""
        received = status.received
        return cls(
            key=tile.key,
            entity_id=tile.entity_id,
            attribute=tile.attribute,
            name=TileName(**tile.name),
            unit=tile.unit,
            decimals=tile.decimals,
            limits=dict(tile.limits),
            state=state,
            value=status.value,
            received_at=moment(received),
            age_s=None if received is None else round(now.mono - received.mono, 3),
            trend=tile.has_trend,
            place=None if tile.place is None else TilePlace.of(*tile.place),
        )


class Measurement(Model):
    """One number of other equipment, as it was kept.

    Attributes:
        at: IVeg's clock when it arrived (ISO-8601 UTC, ms).
        entity_id: The entity at Orion.
        attribute: Its attribute.
        value: The number (``unit``).
        unit: Of the tile at that time; ``1``: none.
    """

    at: str
    entity_id: str
    attribute: str
    value: float
    unit: str

    @classmethod
    def of_record(cls, record: MeasurementRecord) -> "Measurement":
        """As it was kept."""
        return cls(**asdict(record) | {"at": format_stamp(record.at)})
