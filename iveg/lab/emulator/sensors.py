"""What the small sensors of an emulated robot say: one row each."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from iveg.domain.kinds import SENSED
from iveg.domain.observations import UNKNOWN_ORIGIN, Battery, Observation

_BATTERY_LASTS_S = 8 * 3600.0
_BATTERY_FULL, _BATTERY_SWAPPED = 0.95, 0.30


def battery_after(driven_s: float) -> Battery:
    """A battery that drains while driving and is swapped before it is low."""
    usable = _BATTERY_FULL - _BATTERY_SWAPPED
    level = _BATTERY_FULL - (driven_s / _BATTERY_LASTS_S) % usable
    return Battery("", UNKNOWN_ORIGIN, round(level, 3), charging=False, voltage=25.6)


EMULATED: Mapping[type[Observation], Callable[[float], Observation]] = {
    Battery: battery_after,
}
"""The observation after a time of driving (s), by kind."""


@dataclass(slots=True)
class EmulatedSensors:
    """The small sensors of one robot, each at its own rate."""

    _sent_at: dict[str, float] = field(default_factory=dict)

    def due(self, now: float) -> Iterator[Observation]:
        """What is to be sent ``now`` (s of the run)."""
        for kind in SENSED:
            every_s = kind.sensor.every_s if kind.sensor else 0.0
            if now - self._sent_at.get(kind.name, -every_s) >= every_s:
                self._sent_at[kind.name] = now
                yield EMULATED[kind.of](now)
