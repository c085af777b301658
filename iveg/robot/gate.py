"""The gate before the drive: upstream commands, capped, ramped or replaced by zero.

After a resume upstream must request zero for half a second, so that a command issued
during the hold cannot jerk the robot (neutral interlock, docs/safety.md).
"""

import math

from iveg.domain.geometry import REST, Twist2D

NEUTRAL_S = 0.5
TWIST_VALID_S = 0.5
RAMP_M_S2, RAMP_RAD_S2 = 0.5, 2.0
_NEUTRAL_BELOW = 1e-3
_LONGEST_STEP_S = 0.1


class Gate:
    """Turns requested twists into drive commands; times are monotonic seconds.

    Forward, reverse and turning are all scaled by the factor, so the path keeps its
    shape; speed grows by 0.5 m/s² at most and falls at once.

    Args:
        max_speed: (m/s).
        max_turn: (rad/s).
    """

    def __init__(self, max_speed: float, max_turn: float) -> None:
        self._max_speed = max_speed
        self._max_turn = max_turn
        self._requested, self._requested_at = REST, -math.inf
        self._last, self._last_at = REST, -math.inf
        self._neutral_needed = True
        self._neutral_since: float | None = None

    @property
    def neutral_needed(self) -> bool:
        """Whether upstream must still request zero before the robot may move."""
        return self._neutral_needed

    def request_twist(self, twist: Twist2D, now: float) -> None:
        """Take upstream's newest twist; one that is not finite counts as zero."""
        finite = math.isfinite(twist.linear_x) and math.isfinite(twist.angular_z)
        self._requested, self._requested_at = (twist if finite else REST), now

    def require_neutral(self) -> None:
        """Require zero from upstream for 0.5 s before the robot may move again."""
        self._neutral_needed, self._neutral_since = True, None

    def output(self, factor: float, may_drive: bool, now: float) -> Twist2D:
        """Command for the drive at this moment (m/s, rad/s).

        Args:
            factor: 0, 0.5 or 1.
            may_drive: False while anything holds the robot.
            now: Monotonic (s).
        """
        requested = (
            self._requested if now - self._requested_at <= TWIST_VALID_S else REST
        )
        if may_drive and self._neutral_needed:
            self._watch_neutral(requested, now)
        if not may_drive or self._neutral_needed:
            requested = REST
        step = min(_LONGEST_STEP_S, max(0.0, now - self._last_at))
        self._last = self._ramped(self._limited(requested, factor), step)
        self._last_at = now
        return self._last

    def _watch_neutral(self, requested: Twist2D, now: float) -> None:
        if max(abs(requested.linear_x), abs(requested.angular_z)) > _NEUTRAL_BELOW:
            self._neutral_since = None
        elif self._neutral_since is None:
            self._neutral_since = now
        elif now - self._neutral_since >= NEUTRAL_S:
            self._neutral_needed = False

    def _limited(self, requested: Twist2D, factor: float) -> Twist2D:
        over = max(
            1.0,
            abs(requested.linear_x) / self._max_speed,
            abs(requested.angular_z) / self._max_turn,
        )
        return _scaled(requested, factor / over)

    def _ramped(self, aim: Twist2D, step: float) -> Twist2D:
        fastest = _grown(self._last.linear_x, aim.linear_x, RAMP_M_S2 * step)
        if abs(aim.linear_x) > fastest:
            aim = _scaled(aim, fastest / abs(aim.linear_x))
        most = _grown(self._last.angular_z, aim.angular_z, RAMP_RAD_S2 * step)
        return Twist2D(aim.linear_x, max(-most, min(most, aim.angular_z)))


def _grown(last: float, aim: float, growth: float) -> float:
    """Largest magnitude that may follow ``last``; a change of sign starts at 0."""
    return (abs(last) if last * aim > 0 else 0.0) + growth


def _scaled(twist: Twist2D, by: float) -> Twist2D:
    return Twist2D(twist.linear_x * by, twist.angular_z * by)
