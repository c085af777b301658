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
"""The graver first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tile:
    """One attribute of one entity, and how people are shown it.

    Attributes:
        device: At the IoT Agent, which iVeg provisions; empty: somebody else writes the
            entity.
        name: By language, ``es`` and ``en``.
        limits: By name, in the unit; deadband: how far inside one it has to come back.
        silent_after_s: Without a value for so long it has no signal (s).
        has_trend: Whether its last 24 hours are drawn.
        place: Where its mark stands on the map (m, in ``map``).
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
        """Names the tile; no other has this attribute."""
        return f"{self.entity_id}/{self.attribute}"


@dataclass(slots=True)
class TileStatus:
    """Newest knowledge of one tile.

    Attributes:
        value: The newest number; None before the first.
        received: When it came.
        heard_at: When anything came, a number or not (monotonic, s).
        is_readable: Whether the newest value was a number.
        beyond: The limit that it is beyond.
    """

    value: float | None = None
    received: Instant | None = None
    heard_at: float | None = None
    is_readable: bool = True
    beyond: Limit | None = None


class Equipment:
    """All tiles with what is known of them.

    Args:
        tiles: In the order of the file.
        start: When nothing had been heard yet.
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
        """Newest knowledge of a tile."""
        return self._status[tile.key]

    def read(
        self, entity_id: str, values: Mapping[str, object], at: Instant
    ) -> list[Tile]:
        """Take in attributes of an entity; those without a tile are not looked at.

        Returns:
            The tiles that have a new number.
        """
        renewed = []
        for tile in self.tiles:
            value = values.get(tile.attribute)
            # Null is what Orion has of a device that knows no value: nothing was heard.
            if tile.entity_id != entity_id or value is None:
                continue
            status = self._status[tile.key]
            number = _number(value)
            status.heard_at, status.is_readable = at.mono, number is not None
            if number is not None:
                status.value, status.received = number, at
                status.beyond = _beyond(tile, number, status.beyond)
                renewed.append(tile)
        return renewed

    def state(self, tile: Tile, now: Instant) -> State:
        """The state of a tile now."""
        status = self._status[tile.key]
        since = self._start.mono if status.heard_at is None else status.heard_at
        if now.mono - since > tile.silent_after_s:
            return "silent"
        if status.heard_at is None:
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
                yield Condition("P3", f"alert.tile_{state}", tile.key, None, slots)
            elif state == beyond and beyond is not None:
                # The limit and not the value: the sentence stays true while it lasts.
                slots["limit"] = tile.limits[beyond]
                slots["unit"] = "" if tile.unit == "1" else tile.unit
                key = f"alert.tile_{'high' if 'high' in beyond else 'low'}"
                subject = f"{tile.key} {beyond}"
                yield Condition(_PRIORITY[beyond], key, subject, None, slots)


def contradiction(tiles: Sequence[Tile]) -> tuple[int, str, str] | None:
    """The first tile that cannot be beside those before it; None: all can.

    Returns:
        Its index, the name of what is wrong, and why.
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
    """A finite number; None of anything else, truth values and texts among it."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    # No gauge reads more, and a whole number may be larger than any float.
    return float(value) if abs(value) < 1e15 and math.isfinite(value) else None


def _beyond(tile: Tile, value: float, before: Limit | None) -> Limit | None:
    """The gravest limit that a value is beyond; one that it was beyond holds longer."""
    for name in _PRIORITY:
        limit = tile.limits.get(name)
        if limit is None:
            continue
        held = tile.deadband if name == before else 0.0
        over = value - limit if "high" in name else limit - value
        if over + held > 0.0:
            return name
    return None
