"""Other equipment of the greenhouse: its tiles, live and remembered."""

from dataclasses import asdict

from pydantic import Field

from iveg.domain.equipment import Limit, State, TileStatus
from iveg.domain.equipment import Tile as DomainTile
from iveg.domain.observations import Instant
from iveg.domain.records import MeasurementRecord
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, moment


class TileName(Model):
    """What people call it, by language."""

    es: str
    en: str


class TilePlace(Model):
    """Where its mark stands in ``map`` (m)."""

    x: float
    y: float

    @classmethod
    def of(cls, x: float, y: float) -> "TilePlace":
        """As the file says (m)."""
        return cls(x=x, y=y)


class Tile(Model):
    """One attribute of one entity, with its newest number."""

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
    """One number of other equipment, as it was kept."""

    at: str
    entity_id: str
    attribute: str
    value: float
    unit: str

    @classmethod
    def of_record(cls, record: MeasurementRecord) -> "Measurement":
        """As it was kept."""
        return cls(**asdict(record) | {"at": format_stamp(record.at)})
