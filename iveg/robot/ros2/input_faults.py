"""Faults of a robot's ROS 2 inputs: name and effect on the speed.

A fault lasts as long as it is noted, and two seconds more; while it lasts the robot is
slow, or halts where driving on would be a guess.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.observations import RobotFault
from iveg.robot.ros2.reading import clean

LASTS_S = 2.0
_MOST = 16

STANDS = frozenset({"second_publisher"})
"""Faults that hold the robot: another publisher on the drive bypasses the gate."""
HARMLESS = frozenset({"unknown_to_iveg", "nobody_there", "drive_unheard"})
"""Faults without effect: watchdog and age of odometry handle silence, and a factor
changes nothing for a base that hears none."""


@dataclass(frozen=True, slots=True)
class _Noted:
    """Start and end of a fault (monotonic, s); ``for_s`` None: since ``since``."""

    since: float
    last: float
    for_s: float | None


class InputFaults:
    """Record of faults; times are monotonic seconds."""

    def __init__(self) -> None:
        self._noted: dict[tuple[str, str], _Noted] = {}

    def note(
        self, code: str, about: str, now: float, for_s: float | None = None
    ) -> None:
        """Note a fault at this moment.

        Args:
            code: A short, stable name.
            about: Topic or frames.
            now: Monotonic (s).
            for_s: Duration so far, where known from elsewhere (s).
        """
        key = clean(code), clean(about)
        before = self._noted.get(key)
        fresh = before is None or now - before.last > LASTS_S
        since = now if fresh or before is None else before.since
        if fresh and len(self._noted) >= _MOST:
            del self._noted[min(self._noted, key=lambda one: self._noted[one].last)]
        self._noted[key] = _Noted(since, now, for_s)

    def faults(self, now: float) -> tuple[RobotFault, ...]:
        """Present faults, in the order of their start."""
        if not self._noted:
            return ()
        self._noted = {
            key: one for key, one in self._noted.items() if now - one.last <= LASTS_S
        }
        return tuple(
            RobotFault(code, about, now - one.since if one.for_s is None else one.for_s)
            for (code, about), one in self._noted.items()
        )


def speed_of(faults: Iterable[RobotFault]) -> tuple[float, str | None]:
    """Speed factor allowed with these faults, and the fault that determines it."""
    codes = [one.code for one in faults]
    for code in codes:
        if code in STANDS:
            return 0.0, code
    slow = next((code for code in codes if code not in HARMLESS), None)
    return (FULL_SPEED if slow is None else HALF_SPEED), slow
