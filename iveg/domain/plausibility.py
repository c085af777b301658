"""Whether what a robot says can be true: by physics, and by what it said before.

Each finding is a code, a contradiction of :class:`~iveg.domain.doubt.Doubts`; what
cannot be true of any robot is refused before it comes here (``ngsi.payloads``).  Only
news is compared, and the longer of the robot's time and ours counts, so that lateness
and reordering are no contradictions.  docs/safety.md, "Doubt", has the table.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.age import FeedbackLedger
from iveg.domain.fleet import RobotDescription
from iveg.domain.geometry import Rectangle, Twist2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    Observation,
    Odometry,
    Origin,
    Received,
    SafetyReport,
    kind_of,
)
from iveg.domain.robot_state import RobotState

Code = Literal[
    "pose_outside",
    "too_fast",
    "jumped",
    "clock_leapt",
    "boots_often",
    "heard_unsent",
    "stands_moving",
    "foreign_hold",
]
"""``limit_ignored`` is found where limits are told (``pipeline/evaluate.py``)."""

ANY_ROBOT_M_S, ANY_ROBOT_RAD_S = 10.0, 10.0
"""Faster than any robot in a greenhouse: the bound of one that nobody described."""
_SPEED_SHARE, _SPEED_M_S = 1.25, 0.25
"""A drive may overshoot its greatest speed by this, and odometry is noisy (1, m/s)."""
_TURN_SHARE, _TURN_RAD_S = 1.5, 0.5
_JUMP_M = 0.5
"""Corrections of a localisation are smaller (m)."""
_ANCHOR_S = 1.0
"""Poses are compared over so long, so that many small steps add up."""
_LATE_S = 10.0
"""A message may be so much later than the next one; a clock that tells more leapt."""
_BOOTS_APART_S = 5.0
"""No robot starts its programs more often."""
_SAME_MOMENT_S = 0.1
_MOVES_M_S = 0.2
"""Odometry and report of one moment differ by less (m/s)."""


@dataclass(frozen=True, slots=True)
class _Anchor:
    """A pose that later ones are compared with; ``at`` when it came (monotonic, s)."""

    said: Odometry
    at: float

    def passed_s(self, later: Origin, now: float) -> float:
        """How long ago it was measured at most, when ``later`` was (s)."""
        earlier, arrived = self.said.origin, now - self.at
        if earlier.seq is None or later.seq is None:
            return arrived + _LATE_S  # whoever does not count may come in any order
        own = _own_s_between(earlier, later)
        return arrived if own is None else max(arrived, min(own, arrived + _LATE_S))


@dataclass(slots=True)
class _Memory:
    """What one robot said.

    Attributes:
        boots: By stream, its boot and when that replaced another one (monotonic, s).
    """

    anchor: _Anchor | None = None
    boots: dict[type[Observation], tuple[str, float | None]] = field(
        default_factory=dict
    )


class Plausibility:
    """Judges what the robots of a fleet say.

    Args:
        bounds: Of the greenhouse; None: nobody knows where its robots may be.
        ledger: Which feedback was ever sent.
        robot_ids: The fleet.
    """

    def __init__(
        self,
        bounds: Rectangle | None,
        ledger: FeedbackLedger,
        robot_ids: Iterable[str],
    ) -> None:
        self._bounds = bounds
        self._ledger = ledger
        self._memory = {robot_id: _Memory() for robot_id in robot_ids}

    def contradictions(self, robot: RobotState, received: Received) -> Iterator[Code]:
        """Codes of what news contradicts in the robot's state before this message."""
        said, at = received.observation, received.at.mono
        memory = self._memory[robot.robot_id]
        origin = said.origin
        if self._ledger.is_unsent(origin.heard):
            yield "heard_unsent"
        if _boots_often(memory, said, origin, at):
            yield "boots_often"
        match said:
            case Odometry():
                yield from self._of_odometry(robot, memory, said, at)
            case SafetyReport():
                yield from _of_report(robot, said)

    def _of_odometry(
        self, robot: RobotState, memory: _Memory, said: Odometry, at: float
    ) -> Iterator[Code]:
        if self._is_outside(said):
            yield "pose_outside"
        if _is_too_fast(robot.description, said.twist):
            yield "too_fast"
        if _has_jumped(robot.description, memory, said, at):
            yield "jumped"
        if _clock_leapt(robot, said.origin, at):
            yield "clock_leapt"

    def _is_outside(self, said: Odometry) -> bool:
        """Whether a pose is farther outside the walls than they are apart."""
        bounds, pose = self._bounds, said.pose
        if bounds is None:
            return False
        size = max(bounds.xmax - bounds.xmin, bounds.ymax - bounds.ymin)
        return not bounds.contains(pose.x, pose.y, size)


def _of_report(robot: RobotState, said: SafetyReport) -> Iterator[Code]:
    if _is_too_fast(robot.description, Twist2D(said.linear, said.angular)):
        yield "too_fast"
    if _stands_while_moving(robot, said):
        yield "stands_moving"
    if not {hold.id for hold in said.holds}.isdisjoint(said.released):
        # A released id never holds again; whose hold iVeg forgot is adopted instead.
        yield "foreign_hold"


def _is_too_fast(robot: RobotDescription, twist: Twist2D) -> bool:
    turn = ANY_ROBOT_RAD_S
    if robot.is_described:
        turn = _TURN_SHARE * robot.profile.max_turn + _TURN_RAD_S
    return abs(twist.linear_x) > _most_speed(robot) or abs(twist.angular_z) > turn


def _most_speed(robot: RobotDescription) -> float:
    """Speed above which no such robot drives, noise included (m/s)."""
    if not robot.is_described:
        return ANY_ROBOT_M_S
    return _SPEED_SHARE * robot.profile.max_speed + _SPEED_M_S


def _has_jumped(
    robot: RobotDescription, memory: _Memory, said: Odometry, at: float
) -> bool:
    """Whether it cannot have come here since an earlier pose of the same boot."""
    anchor = memory.anchor
    if anchor is None or anchor.said.origin.boot != said.origin.boot:
        memory.anchor = _Anchor(said, at)
        return False
    reach = _most_speed(robot) * anchor.passed_s(said.origin, at) + _JUMP_M
    jumped = anchor.said.pose.distance_to(said.pose.x, said.pose.y) > reach
    if jumped or at - anchor.at >= _ANCHOR_S:
        memory.anchor = _Anchor(said, at)
    return jumped


def _own_s_between(earlier: Origin, later: Origin) -> float | None:
    """Seconds between two messages on the robot's own clock; None where unknown."""
    if (earlier.mono is None) != (later.mono is None):
        return None
    then, now = earlier.own_s, later.own_s
    return None if then is None or now is None else now - then


def _clock_leapt(robot: RobotState, origin: Origin, at: float) -> bool:
    """Whether seconds since a boot fell, or ran ahead of all lateness.

    Stamps are another matter: clocks are set (``domain/clocks.py``).
    """
    before, received = robot.odometry, robot.odometry_received
    if before is None or received is None or before.origin.boot != origin.boot:
        return False
    if origin.seq is None or origin.mono is None or before.origin.mono is None:
        return False
    own = origin.mono - before.origin.mono
    return own < 0.0 or own > at - received.mono + _LATE_S


def _boots_often(memory: _Memory, said: Observation, origin: Origin, at: float) -> bool:
    """Whether a stream began anew just after it had begun anew."""
    kind, boot = kind_of(said), origin.boot
    known, changed_at = memory.boots.get(kind, (None, None))
    if boot is None or boot == known:
        return False
    memory.boots[kind] = boot, None if known is None else at
    return changed_at is not None and at - changed_at < _BOOTS_APART_S


def _stands_while_moving(robot: RobotState, report: SafetyReport) -> bool:
    """Whether it reports rest at a moment at which its wheels turned."""
    odometry = robot.odometry
    if odometry is None or odometry.origin.boot != report.origin.boot:
        return False
    moment, driven = report.origin.mono, odometry.origin.mono
    if moment is None or driven is None or abs(moment - driven) > _SAME_MOMENT_S:
        return False
    rests = abs(report.linear) < LIMITS.standing_speed
    return rests and abs(odometry.twist.linear_x) >= _MOVES_M_S


def ignores_limit(report: SafetyReport, measured_at: float, limited_at: float) -> bool:
    """Whether a robot drives at a factor above its limit long after it was told.

    Args:
        report: What it applies.
        measured_at: The report was not measured before this moment (monotonic, s).
        limited_at: When the limit was first told (monotonic, s).
    """
    waited = measured_at - limited_at
    return report.speed_factor > LIMITS.slow_factor and waited > LIMITS.release_within_s
