"""Speed caps of a robot, its own foresight, and the gate before the drive."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.limits import LIMITS
from iveg.domain.rule.paths import (
    EVERY_S,
    HORIZON_S,
    MOVES_M_S,
    PLAN_LASTS_S,
    Meeting,
    MovingZone,
    MovingZones,
    Plan,
    path_ahead,
    slows_within_s,
    sped_up,
)

# --- caps -------------------------------------------------------------------------
#
# Speed caps of a robot: the lowest applies, at once when lower, delayed when higher.
#
# Factors are 0, 0.5 or 1 and are never multiplied (docs/safety.md): two overlapping
# zones still halve the speed. A raw cap that falls applies immediately; one that rises
# must stay up for one second first, and a lower cap within that second counts. A cap
# whose reason ended while it still applies (``waits`` False) has no further second.

_REASONS = (
    *("clear", "unsupervised", "stale", "doubt", "watchdog"),
    *("obstacle", "robot", "person"),
)
"""Reasons of a cap in a report; at equal factors the later one is reported."""


@dataclass(frozen=True, slots=True)
class Cap:
    """One reason not to drive faster than ``factor``.

    Attributes:
        factor: Share of the greatest speed: 0, 0.5 or 1.
        reason: One of ``_REASONS``.
        cause: Robot or hold behind the reason; None without.
        decision_id: Decision of iVeg that it follows; None without.
        waits: Whether it ends a second after its last receipt.  False: its reason has
            ended, and that second already runs.
    """

    factor: float
    reason: str
    cause: str | None = None
    decision_id: str | None = None
    # Not compared, since reports do not show it.
    waits: bool = field(default=True, compare=False)

    def _order(self) -> tuple[float, int, bool, bool]:
        reason = -_REASONS.index(self.reason)
        return self.factor, reason, self.cause is None, self.decision_id is None


FREE = Cap(FULL_SPEED, "clear")


def quantised(factor: float) -> float:
    """Largest allowed factor that is not above the given one (R6)."""
    if factor >= FULL_SPEED:
        return FULL_SPEED
    return HALF_SPEED if factor >= HALF_SPEED else 0.0


def known_reason(reason: str) -> str:
    """Reason that a report may carry; an unknown one is reported as ``stale``."""
    return reason if reason in _REASONS and reason != "clear" else "stale"


def lowest(caps: Iterable[Cap]) -> Cap:
    """The effective cap: lowest factor; if equal, people, then robots, then silence."""
    return min((*caps, FREE), key=Cap._order)


@dataclass(frozen=True, slots=True)
class AppliedCap:
    """The cap in force and a pending higher one.

    Attributes:
        waiting: Lowest raw cap since ``since``, all above ``cap``; None: no change.
    """

    cap: Cap
    waiting: Cap | None = None
    since: float = 0.0

    def settle(self, raw: Cap, now: float) -> "AppliedCap":
        """Apply the present raw cap: at once when lower, after 1.0 s when higher."""
        if raw.factor <= self.cap.factor:
            return AppliedCap(raw)
        if self.waiting is None:
            return AppliedCap(self.cap, raw, now)
        waiting = lowest((self.waiting, raw))
        if now - self.since < LIMITS.release_after_s:
            return AppliedCap(self.cap, waiting, self.since)
        # ``raw`` may exceed every cap of that second: then its own second begins.
        return AppliedCap(waiting).settle(raw, now)


# --- lookahead --------------------------------------------------------------------
#
# Foresight on the robot itself, by its own odometry and plan: it needs no network.
#
# It shares the server's arithmetic (``iveg.domain.rule.paths``), takes the people and
# peers of the feedback, and only adds a cap (docs/safety.md, "Foresight").

CappedZone = tuple[MovingZone, Cap]
"""A zone, and the cap that applies inside."""


class Lookahead:
    """Foresight of one robot.

    Args:
        braking: Deceleration of its brakes (m/s²).
    """

    def __init__(self, braking: float) -> None:
        self._braking = braking
        self._plan: Plan | None = None
        self._plan_at = self._at = -math.inf
        self._caps: tuple[Cap, ...] = ()
        self._speed_before = 0.0

    def note_path(self, path: Plan, now: float) -> None:
        """Note the robot's own plan; a point that is not finite makes it no plan."""
        is_read = all(math.isfinite(number) for point in path for number in point)
        self._plan, self._plan_at = path if is_read else None, now

    def is_due(self, now: float) -> bool:
        """Whether the last look is ``EVERY_S`` old."""
        return not 0.0 <= now - self._at < EVERY_S

    def look(
        self, pose: Pose2D, twist: Twist2D, zones: Sequence[CappedZone], now: float
    ) -> None:
        """Cap the speed for every zone that the robot is about to reach."""
        self._at, speed = now, abs(twist.linear_x)
        if speed < MOVES_M_S or not zones:
            self._caps = ()
            return
        self._speed_before = max(self._speed_before, speed) if self._caps else speed
        plan = self._plan if now - self._plan_at <= PLAN_LASTS_S else None
        moving = MovingZones([zone for zone, _ in zones])

        def meetings_at(speed: float) -> Iterator[Meeting]:
            """First meetings with the zones, at a speed (m/s) or faster."""
            return moving.met_by(path_ahead(pose, sped_up(twist, speed), plan))[1]

        soon_s, meetings = slows_within_s(self._braking, speed), [*meetings_at(speed)]
        reached_now = {meeting.zone for meeting in meetings if meeting.in_s <= soon_s}
        if self._caps:
            # Else slowing would end an encounter, and speeding up bring it back.
            meetings += meetings_at(self._speed_before)
        reached_later = {item.zone for item in meetings if item.in_s <= HORIZON_S}
        self._caps = tuple(
            cap
            for number, (_, cap) in enumerate(zones)
            if number in reached_now or (number in reached_later and cap in self._caps)
        )

    def forget(self) -> None:
        """Drop all encounters, for a robot whose own pose is not known."""
        self._caps, self._at = (), -math.inf

    @property
    def cap(self) -> Cap:
        """Half speed while an encounter is due; else free."""
        return lowest(self._caps)


# --- gate -------------------------------------------------------------------------
#
# The gate before the drive: upstream commands, capped, ramped or replaced by zero.
#
# After a resume upstream must request zero for half a second, so that a command issued
# during the hold cannot jerk the robot (neutral interlock, docs/safety.md).

NEUTRAL_S = 0.5
# Navigation that hangs or died must not leave the robot driving.
TWIST_VALID_S = 0.5
RAMP_M_S2, RAMP_RAD_S2 = 0.5, 2.0
_NEUTRAL_BELOW = 1e-3
"""A request below this is rest (m/s, rad/s)."""
# After a pause of the process the speed grows by one late tick, not by the pause.
_LONGEST_TICK_S = 0.1


class Gate:
    """Turns requested twists into drive commands; times are monotonic seconds.

    Forward, reverse and turning are all scaled by the factor, so the path keeps its
    shape; speed grows by 0.5 m/s² at most and falls at once.

    Args:
        max_speed: (m/s).
        max_turn: (rad/s).
    """

    def __init__(self, max_speed: float, max_turn: float) -> None:
        self._max_speed, self._max_turn = max_speed, max_turn
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
        # R10: rest that was requested while the robot was held does not count.
        if may_drive and self._neutral_needed:
            self._watch_neutral(requested, now)
        if not may_drive or self._neutral_needed:
            requested = REST
        dt = min(_LONGEST_TICK_S, max(0.0, now - self._last_at))
        self._last = self._ramped(self._limited(requested, factor), dt)
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
        # By one divisor for both, so that a twist that is too fast keeps its arc.
        divisor = max(
            1.0,
            abs(requested.linear_x) / self._max_speed,
            abs(requested.angular_z) / self._max_turn,
        )
        return _scaled(requested, factor / divisor)

    def _ramped(self, aim: Twist2D, dt: float) -> Twist2D:
        fastest = _grown(self._last.linear_x, aim.linear_x, RAMP_M_S2 * dt)
        if abs(aim.linear_x) > fastest:
            aim = _scaled(aim, fastest / abs(aim.linear_x))
        turn = _grown(self._last.angular_z, aim.angular_z, RAMP_RAD_S2 * dt)
        return Twist2D(aim.linear_x, max(-turn, min(turn, aim.angular_z)))


def _grown(last: float, aim: float, growth: float) -> float:
    """Largest magnitude that may follow ``last``; a change of sign starts at 0."""
    return (abs(last) if last * aim > 0 else 0.0) + growth


def _scaled(twist: Twist2D, by: float) -> Twist2D:
    return Twist2D(twist.linear_x * by, twist.angular_z * by)
