"""Equipment files: TOML in, checked tiles out (docs/equipment.md)."""

from collections.abc import Sequence
from typing import Annotated, Self

from pydantic import Field, model_validator

from iveg.adapters.toml_files import Table, complaint, must, read_table, read_text
from iveg.domain.equipment import UNITS, Limit, Tile, contradiction
from iveg.domain.fleet import is_robot_id
from iveg.ngsi import names

DEMO = "demo"
"""Name of the file of the equipment that the emulator plays."""
_LIMITS: tuple[Limit, ...] = ("low_low", "low", "high", "high_high")
_FARTHEST_M = 1e6


def load_equipment(name_or_file: str, robots: Sequence[str] = ()) -> tuple[Tile, ...]:
    """Tiles of a file, or of ``demo``; none for an empty name.

    Args:
        name_or_file: Value of the setting.
        robots: The fleet, whose entities and devices no tile may name.

    Raises:
        DataFileError: the file cannot be used; it names file and key.
    """
    if not name_or_file:
        return ()
    text = read_text(name_or_file, {DEMO: "equipment.toml"})
    return read_equipment(text, name_or_file, robots)


def read_equipment(
    text: str, file: str, robots: Sequence[str] = ()
) -> tuple[Tile, ...]:
    """Read tiles from TOML; ``file`` is its name in complaints.

    Raises:
        DataFileError: naming file, key and reason.
    """
    tiles = tuple(row.value() for row in read_table(text, file, _FileTable).tiles)
    wrong = contradiction(tiles) or _taken(tiles, robots)
    if wrong is not None:
        index, key, reason = wrong
        raise complaint(file, ("tiles", index, key), reason)
    return tiles


def _taken(tiles: Sequence[Tile], robots: Sequence[str]) -> tuple[int, str, str] | None:
    """The first tile that would take a robot's entity, or its device and orders."""
    for index, tile in enumerate(tiles):
        for key, name in (("entity", tile.entity_id), ("device", tile.device)):
            if name in robots:
                return index, key, f"{name} is a robot of the fleet"
    return None


# --- the shape of the file --------------------------------------------------------


_ROBOTS_AND_PROBE = names.ROBOT_TYPE, names.HEARTBEAT_TYPE
# What NGSI-v2 allows in ids, types and names of attributes.
_Word = Annotated[str, Field(pattern=r"""^[^\s<>"'=;()&?/#]{1,128}$""")]
_Name = Annotated[str, Field(min_length=1, max_length=48)]
_Metres = Annotated[float, Field(ge=-_FARTHEST_M, le=_FARTHEST_M)]


class _Names(Table):
    es: _Name
    en: _Name


class _Place(Table):
    x: _Metres
    y: _Metres


class _Tile(Table):
    entity_id: Annotated[
        _Word,
        must(
            lambda text: text != names.CLIMATE_ID, "the climate has its tiles already"
        ),
        Field(alias="entity"),
    ]
    entity_type: Annotated[
        _Word,
        must(
            lambda text: text not in _ROBOTS_AND_PROBE,
            "{} is no equipment: robots have sensors of their own",
        ),
        Field(alias="type"),
    ]
    attribute: _Word
    name: _Names
    unit: Annotated[str, must(UNITS.__contains__, f"must be one of {', '.join(UNITS)}")]
    decimals: Annotated[int, Field(ge=0, le=4)] = 1
    low_low: float | None = None
    low: float | None = None
    high: float | None = None
    high_high: float | None = None
    deadband: Annotated[float, Field(ge=0)] = 0.0
    silent_after_s: Annotated[float, Field(ge=1, le=604_800)] = 300.0
    has_trend: Annotated[bool, Field(alias="trend")] = True
    place: _Place | None = None
    device: Annotated[
        str,
        must(
            is_robot_id, "must be 1 to 64 letters, digits and hyphens, and not iVeg's"
        ),
    ] = ""

    @model_validator(mode="after")
    def _limits_rise(self) -> Self:
        limits = list(self._limits().values())
        if limits != sorted(set(limits)):
            raise ValueError("low_low, low, high and high_high must rise")
        return self

    def _limits(self) -> dict[Limit, float]:
        limits = {name: getattr(self, name) for name in _LIMITS}
        return {name: limit for name, limit in limits.items() if limit is not None}

    def value(self) -> Tile:
        place = None if self.place is None else (self.place.x, self.place.y)
        fields = self.model_dump(exclude={*_LIMITS, "place"})
        return Tile(**fields, limits=self._limits(), place=place)


class _FileTable(Table):
    tiles: Annotated[list[_Tile], Field(min_length=1, max_length=64)]
