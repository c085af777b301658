"""Navigation and drive of an emulated ROS 2 base."""

import math

from iveg.domain.geometry import REST, Twist2D

TIMEOUT_S = 0.5
"""A base without a command for this long halts (s)."""


_GIVES_UP_S, _RESTS_S = 1.0, 0.8


class SimulatedNavigation:
    """Nav2 as a gate meets it: requests twists, gives up without progress, tries again.

    After a resume the gate stays closed until zero was requested; a real navigation
    without progress cancels its goal and requests zero.
    """

    def __init__(self) -> None:
        self._stuck_since: float | None = None
        self._rests_until = -math.inf

    def requested_twist(
        self, requested: Twist2D, driven: Twist2D, now: float
    ) -> Twist2D:
        """The twist requested now; ``driven`` was the last command of the base."""
        if now < self._rests_until:
            return REST
        if requested == REST or driven != REST:
            self._stuck_since = None
        elif self._stuck_since is None:
            self._stuck_since = now
        elif now - self._stuck_since > _GIVES_UP_S:
            self._stuck_since, self._rests_until = None, now + _RESTS_S
            return REST
        return requested


class DriveWatchdog:
    """The drive's own watchdog: the newest command while it is valid."""

    def __init__(self) -> None:
        self._command, self._at = REST, -math.inf

    def replace_command(self, command: Twist2D, now: float) -> None:
        """Note the newest command."""
        self._command, self._at = command, now

    def command(self, now: float) -> Twist2D:
        """Command for the wheels; zero when none came for half a second."""
        return self._command if now - self._at <= TIMEOUT_S else REST
