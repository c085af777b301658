"""Foresight on the robot itself, by its own odometry and plan: it needs no network.

The same arithmetic as the server's (``iveg.domain.rule.paths``), for the people and
peers that feedback told; it only adds a cap (docs/safety.md, "Foresight").
"""

import math
from collections.abc import Sequence

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.rule.paths import (
    EVERY_S,
    HOLDS_S,
    HORIZON_S,
    MOVES_M_S,
    PLAN_LASTS_S,
    Circles,
    Plan,
    path_ahead,
    slows_within_s,
    sped_up,
)
from iveg.robot.caps import Cap, lowest

Ahead = tuple[tuple[float, ...], Cap]
"""A circle as ``Circles`` has it, and the cap that it asks for inside."""


class Lookahead:
    """What one robot foresees.

    Args:
        braking: What its brakes can do (m/s²).
    """

    def __init__(self, braking: float) -> None:
        self._braking = braking
        self._plan: Plan | None = None
        self._plan_at = self._at = -math.inf
        self._caps: tuple[Cap, ...] = ()
        self._speed_before = 0.0

    def note_path(self, path: Plan, now: float) -> None:
        """Note the robot's own plan (monotonic, s); one that is no number is none."""
        is_read = all(math.isfinite(one) for point in path for one in point)
        self._plan, self._plan_at = path if is_read else None, now

    def is_due(self, now: float) -> bool:
        """Whether the last look is old (monotonic, s)."""
        return not 0.0 <= now - self._at < EVERY_S

    def look(
        self, pose: Pose2D, twist: Twist2D, ahead: Sequence[Ahead], now: float
    ) -> None:
        """Find the circles that it is about to reach, to be slow there."""
        self._at = now
        if abs(twist.linear_x) < MOVES_M_S or not ahead:
            self._caps = ()
            return
        plan = self._plan if now - self._plan_at <= PLAN_LASTS_S else None
        circles, speed = Circles([row for row, _ in ahead]), abs(twist.linear_x)
        self._speed_before = max(self._speed_before, speed) if self._caps else speed

        def met(speed: float, within_s: float) -> set[Cap]:
            """Caps of the circles that it reaches so soon at this speed (m/s)."""
            _, meetings = circles.met_by(path_ahead(pose, sped_up(twist, speed), plan))
            return {ahead[one.circle][1] for one in meetings if one.in_s <= within_s}

        due, held = met(speed, slows_within_s(self._braking, speed)), set[Cap]()
        if self._caps:
            # What lies ahead again at the speed of before is no reason to speed up.
            held = met(speed, HOLDS_S) | met(self._speed_before, HORIZON_S)
        self._caps = tuple(
            cap for _, cap in ahead if cap in due or (cap in held and cap in self._caps)
        )

    def forget(self) -> None:
        """Drop what was foreseen: nobody knows where the robot is."""
        self._caps, self._at = (), -math.inf

    @property
    def cap(self) -> Cap:
        """Half speed for whom it is about to reach."""
        return lowest(self._caps)
