"""Other equipment of the greenhouse: tiles of NGSI attributes, and their faults.

A tile shows one number of one entity: the conductivity of a fertigation unit, the
permeate of an osmosis plant.  No rule rests on it.  ::

    waiting ── a number ──> ok | low | high | low_low | high_high
       |                     |  ^
       └── nothing for ──> silent      unreadable: the newest value is no number
           silent_after_s
"""

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.events import Condition, Priority, Slot
from iveg.domain.observations import Instant

UNITS = (
    *("°C", "K", "%", "1", "pH", "ppm", "mg/L", "mmol/L", "mS/cm", "µS/cm", "dS/m"),
    *("mV", "V", "A", "W", "kW", "Wh", "kWh", "W/m²", "J/cm²", "µmol/m²s", "lx", "klx"),
    *("Pa", "kPa", "bar", "mbar", "hPa", "L", "m³", "L/min", "L/h", "m³/h", "L/m²"),
    *("mm", "cm", "m", "m/s", "kg", "g/m³", "Hz", "rpm", "s", "min", "h"),
)
"""Units that a tile may have; ``1`` is a number without a unit."""

State = Literal[
    "waiting", "ok", "low", "high", "low_low", "high_high", "silent", "unreadable"
]
Limit = Literal["low_low", "low", "high", "high_high"]
_PRIORITY: Mapping[Limit, Priority] = {
    "low_low": "P2",
    "high_high": "P2",
    "low": "P3",
    "high": "P3",
}
"""Priority of the alert of each limit; the graver limits first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tile:
    """One attribute of one entity, with its display and limits.

    Attributes:
        name: Its name by language, ``es`` and ``en``.
        limits: Limits by name, in the unit.
        deadband: Distance inside a limit at which its alert clears, in the unit.
        silent_after_s: Age of the newest value from which it has no signal (s).
        has_trend: Whether its last 24 hours are drawn.
        place: Position of its mark in ``map`` (m).
        device: Its device at the IoT Agent, which iVeg provisions; empty: another
            program writes the entity.
    """

    entity_id: str
    entity_type: str
    attribute: str
    name: Mapping[str, str]
    unit: str
    decimals: int = 1
    limits: Mapping[Limit, float] = field(default_factory=dict)
    deadband: float = 0.0
    silent_after_s: float = 300.0
    has_trend: bool = True
    place: tuple[float, float] | None = None
    device: str = ""

    @property
    def key(self) -> str:
        """Id of the tile: entity and attribute, which no other tile has."""
        return f"{self.entity_id}/{self.attribute}"


@dataclass(slots=True)
class TileStatus:
    """Newest value of one tile.

    Attributes:
        value: The newest number; None before the first.
        received: Arrival of that number.
        updated_at: Arrival of the newest value, a number or not (monotonic, s).
        is_readable: Whether the newest value was a number.
        beyond: Gravest limit that the number is beyond; None: it is within all.
    """

    value: float | None = None
    received: Instant | None = None
    updated_at: float | None = None
    is_readable: bool = True
    beyond: Limit | None = None


class Equipment:
    """Tiles with their newest values.

    Args:
        tiles: Tiles in the order of the file.
        start: Start of iVeg; silence before the first value counts from here.
    """

    def __init__(self, tiles: Sequence[Tile], start: Instant) -> None:
        self.tiles = tuple(tiles)
        self._start = start
        self._status = {tile.key: TileStatus() for tile in tiles}

    @property
    def entities(self) -> Container[tuple[str, str]]:
        """Id and type of each entity that a tile is about."""
        return frozenset((tile.entity_id, tile.entity_type) for tile in self.tiles)

    def status(self, tile: Tile) -> TileStatus:
        """Newest value of a tile."""
        return self._status[tile.key]

    def read(
        self, entity_id: str, values: Mapping[str, object], at: Instant
    ) -> list[Tile]:
        """Take attributes of an entity; attributes without a tile are ignored.

        Returns:
            Tiles with a new number.
        """
        renewed = []
        for tile in self.tiles:
            value = values.get(tile.attribute)
            # Orion stores null for a device without a value: nothing was received.
            if tile.entity_id != entity_id or value is None:
                continue
            status = self._status[tile.key]
            number = _number(value)
            status.updated_at, status.is_readable = at.mono, number is not None
            if number is not None:
                status.value, status.received = number, at
                status.beyond = _beyond(tile, number, status.beyond)
                renewed.append(tile)
        return renewed

    def state(self, tile: Tile, now: Instant) -> State:
        """State of a tile now."""
        status = self._status[tile.key]
        since = self._start.mono if status.updated_at is None else status.updated_at
        if now.mono - since > tile.silent_after_s:
            return "silent"
        if status.updated_at is None:
            return "waiting"
        if not status.is_readable:
            return "unreadable"
        return status.beyond or "ok"

    def conditions(self, now: Instant) -> Iterator[Condition]:
        """Conditions of tiles that are silent, unreadable or beyond a limit."""
        for tile in self.tiles:
            state, beyond = self.state(tile, now), self._status[tile.key].beyond
            slots: dict[str, Slot] = {"tile": tile.key}
            slots |= {f"tile_{language}": name for language, name in tile.name.items()}
            if state in ("silent", "unreadable"):
                slots["minutes"] = round(tile.silent_after_s / 60.0, 1)
                yield Condition.filled("P3", f"alert.tile_{state}", tile.key, **slots)
            elif state == beyond and beyond is not None:
                # The sentence names the limit: the value would be outdated at once.
                slots["limit"] = tile.limits[beyond]
                slots["unit"] = "" if tile.unit == "1" else tile.unit
                key = f"alert.tile_{'high' if 'high' in beyond else 'low'}"
                subject = f"{tile.key} {beyond}"
                yield Condition.filled(_PRIORITY[beyond], key, subject, **slots)


def contradiction(tiles: Sequence[Tile]) -> tuple[int, str, str] | None:
    """First tile that contradicts an earlier one; None: all agree.

    Returns:
        Its index, the name of the wrong member, and the reason.
    """
    for index, tile in enumerate(tiles):
        for other in tiles[:index]:
            if other.key == tile.key:
                return index, "attribute", f"{tile.key} has a tile already"
            if other.entity_id == tile.entity_id:
                if other.entity_type != tile.entity_type:
                    return index, "type", f"{tile.entity_id} is a {other.entity_type}"
            elif tile.device and other.device == tile.device:
                return index, "device", f"{tile.device} feeds {other.entity_id}"
    return None


def _number(value: object) -> float | None:
    """A finite number; None for anything else, truth values and texts included."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    # No gauge shows more, and a whole number may exceed the range of a float.
    return float(value) if abs(value) < 1e15 and math.isfinite(value) else None


def _beyond(tile: Tile, value: float, before: Limit | None) -> Limit | None:
    """Gravest limit that a value is beyond; limit ``before`` has a deadband."""
    for name in _PRIORITY:
        limit = tile.limits.get(name)
        if limit is None:
            continue
        deadband = tile.deadband if name == before else 0.0
        excess = value - limit if "high" in name else limit - value
        if excess + deadband > 0.0:
            return name
    return None
