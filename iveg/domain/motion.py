"""Motion of one robot, by the poses, twists and reports of its last second.

No single source proves a rest: wheels slip, localisation dies, and a robot that drives
sideways has no twist that iVeg reads.  So a robot moves as soon as any of the three
shows it, and is as fast as the largest of them::

    twist, report   above 0.02 m/s or rad/s
    pose            changed by more than 0.10 m or rad within a second, in three steps
                    or more: one or two that stand out are jumps of a localisation

Less than six changes a second (odometry through Orion) are too few.  Then one step that
stands out is a jump, and two equal steps are motion, so a robot with poses at 2 Hz
moves from its second step on.  The last three poses are kept even if they are
older than a second, so that two steps can be compared.

Time is the robot's own, if it is sent and does not gain on ours, else that of arrival.
So messages in a burst or after a pause show no other motion.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from statistics import median
from typing import Literal, NamedTuple

from iveg.domain.geometry import Pose2D, Twist2D, wrap_angle
from iveg.domain.limits import LIMITS
from iveg.domain.observations import UNKNOWN_ORIGIN, Origin

Contradiction = Literal["pose_against_twist", "sideways", "yaw_against_turn"]

WINDOW_S = 1.0
"""Time over which motion is measured (s)."""
_LEAST_POSES, _FORGOTTEN_S = 3, 3.0
"""Poses that are kept beyond the window, and their greatest age (s)."""
_APART_S = 0.08
"""Least time between two steps: thirty poses a second show no more (s)."""
_JITTER = 0.06
"""Greatest step of a resting pose: 3 cm or 0.03 rad to either side (m, rad)."""
_MOST_NOISE, _NOISES = 0.09, 1.2
"""Greatest noise that counts (m, rad), and its multiple that is no motion (1)."""
_MANY_STEPS = 6
_AHEAD_S = 10.0
"""Gain of a clock on ours beyond which it is not used: no message is so late (s)."""
_JUDGED_S = 0.5 - 1e-6, 1.5
"""Least and greatest time over which poses and twists are compared (s)."""
LASTED_S = 0.3
"""Least duration of a contradiction when it is found (s)."""
_SLIP_SHARE, _TURN_SHARE = 0.2, 0.3
"""Slip of wheels, and slip in a turn (1)."""
_BEHIND_M = 0.5
"""Greatest distance of a turning point behind ``base_link`` (m)."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of a robot over its last second.

    Attributes:
        speed: Largest speed of pose, twist and report (m/s).
        turn: Largest turn rate of the three (rad/s).
        moves: Whether any of the three shows motion.
        contradiction: Fields of its odometry that contradict each other.
        pose_moves: Whether the pose shows motion.
        course: Direction of the pose's motion in ``map`` (rad); None: by the twist.
        displaced: Whether the pose was farther than 0.10 m away within the last second,
            by motion, noise or a jump.
    """

    speed: float = 0.0
    turn: float = 0.0
    moves: bool = False
    contradiction: Contradiction | None = None
    pose_moves: bool = False
    course: float | None = None
    displaced: bool = False

    def ahead(self, pose: Pose2D, twist: Twist2D) -> tuple[Pose2D, Twist2D]:
        """Pose and twist of odometry for a forecast, at the measured speed."""
        if self.course is not None:
            return Pose2D(pose.x, pose.y, self.course), Twist2D(self.speed, 0.0)
        if self.speed <= abs(twist.linear_x):
            return pose, twist
        speed = math.copysign(self.speed, twist.linear_x)
        return pose, Twist2D(speed, twist.angular_z)


UNMOVED = Motion()


class _Sample(NamedTuple):
    """One odometry.

    Attributes:
        at: Time on the track's own axis (s).
        x: Position in ``map`` (m); ``y`` likewise.
        yaw: Heading without wraps (rad).
        linear: Speed by the twist (m/s).
        angular: Turn rate by the twist (rad/s).
    """

    at: float
    x: float
    y: float
    yaw: float
    linear: float
    angular: float


class _Twist(NamedTuple):
    """Newest speeds of one source (m/s, rad/s); ``at``: measured (monotonic, s)."""

    linear: float
    angular: float
    at: float


@dataclass(slots=True)
class MotionTrack:
    """Poses, twists and reports of one robot, and the motion that they show.

    Attributes:
        motion: The motion by all three.
        _shown: Motion by poses alone.
    """

    motion: Motion = UNMOVED
    _samples: list[_Sample] = field(default_factory=list)
    _twist: _Twist | None = None
    _report: _Twist | None = None
    _origin: Origin = UNKNOWN_ORIGIN
    _arrived: float = 0.0
    _ahead_s: float = 0.0
    _shown: Motion = UNMOVED

    def note_odometry(
        self,
        pose: Pose2D | None,
        twist: Twist2D,
        at: float,
        origin: Origin = UNKNOWN_ORIGIN,
        arrived: float | None = None,
    ) -> Motion:
        """Note odometry; without a pose its twist alone counts.

        Args:
            pose: Pose in ``map``.
            twist: Twist in ``base_link``.
            at: Time of measurement, as far as known (monotonic, s).
            origin: Count and clock of the message.
            arrived: Time of arrival (monotonic, s); None: ``at``.
        """
        self._twist = _Twist(abs(twist.linear_x), abs(twist.angular_z), at)
        arrived = at if arrived is None else arrived
        if pose is not None and self._keep(pose, twist, arrived, origin):
            self._shown = _shown_by(self._samples)
        return self._judge()

    def note_report(self, linear: float, angular: float, at: float) -> Motion:
        """Note the speeds of a report (m/s, rad/s), measured at ``at``."""
        self._report = _Twist(abs(linear), abs(angular), at)
        return self._judge()

    def _judge(self) -> Motion:
        twists = [twist for twist in (self._twist, self._report) if twist is not None]
        newest = max(twist.at for twist in twists)
        # A silent source must not hold its last speed for ever.
        twists = [twist for twist in twists if newest - twist.at <= WINDOW_S]
        linear = max(twist.linear for twist in twists)
        angular = max(twist.angular for twist in twists)
        shown = self._shown if self._twist in twists else UNMOVED
        self.motion = replace(
            shown,
            speed=max(linear, shown.speed),
            turn=max(angular, shown.turn),
            moves=shown.pose_moves or max(linear, angular) >= LIMITS.standing_speed,
        )
        return self.motion

    def _keep(
        self, pose: Pose2D, twist: Twist2D, arrived: float, origin: Origin
    ) -> bool:
        """Keep a pose that is late enough for a step; returns whether it is."""
        samples, at, yaw = self._samples, 0.0, pose.yaw
        if samples:
            last = samples[-1]
            ahead_s, passed_s = self._passed_s(origin, arrived - self._arrived)
            if passed_s < _APART_S:
                return False
            at, self._ahead_s = last.at + passed_s, ahead_s
            yaw = last.yaw + wrap_angle(pose.yaw - last.yaw)
        self._origin, self._arrived = origin, arrived
        samples.append(
            _Sample(at, pose.x, pose.y, yaw, twist.linear_x, twist.angular_z)
        )
        while at - samples[0].at > _FORGOTTEN_S or (
            len(samples) > _LEAST_POSES and at - samples[0].at > WINDOW_S + 1e-6
        ):
            del samples[0]
        return True

    def _passed_s(self, later: Origin, arrived_s: float) -> tuple[float, float]:
        """Gain of a robot's clock on ours, and the time passed (s).

        The robot's clock counts if it rises, and gains less than the greatest delay.
        """
        earlier, arrived_s = self._origin, max(0.0, arrived_s)
        if earlier.boot != later.boot or (earlier.mono is None) != (later.mono is None):
            return 0.0, arrived_s
        before, after = earlier.own_s, later.own_s
        if before is None or after is None or after <= before:
            return self._ahead_s, arrived_s
        ahead_s = self._ahead_s + after - before - arrived_s
        if ahead_s > _AHEAD_S:
            return self._ahead_s, arrived_s
        return ahead_s, after - before


def _shown_by(samples: Sequence[_Sample]) -> Motion:
    """Motion by poses alone, with their contradictions to the twists."""
    steps = list(pairwise(samples))
    seconds = [b.at - a.at for a, b in steps]
    place = _shift(seconds, [(b.x - a.x, b.y - a.y) for a, b in steps])
    heading = _shift(seconds, [(b.yaw - a.yaw, 0.0) for a, b in steps])
    contradiction = _contradiction(samples, place, heading)
    moves = place.moves or heading.moves
    # A sideways or sliding robot moves by its poses, not by its heading.
    course = None
    if place.rate and contradiction in ("pose_against_twist", "sideways"):
        course = math.atan2(place.dy, place.dx)
    newest = samples[-1]
    displaced = any(
        math.hypot(newest.x - sample.x, newest.y - sample.y) > LIMITS.standing_moved
        for sample in samples
    )
    return Motion(
        place.rate,
        heading.rate,
        moves,
        contradiction=contradiction,
        pose_moves=moves,
        course=course,
        displaced=displaced,
    )


class _Shift(NamedTuple):
    """A change of place or heading in the window, without jumps.

    Attributes:
        moves: Whether it is motion.
        rate: Rate beyond the noise (m/s or rad/s); 0 without motion.
        dx: Sum of its steps (m or rad); ``dy`` likewise.
        jumps: Numbers of the steps that are jumps.
        noise: Noise of the pose (m or rad).
    """

    moves: bool
    rate: float
    dx: float
    dy: float
    jumps: frozenset[int]
    noise: float


def _shift(seconds: Sequence[float], steps: Sequence[tuple[float, float]]) -> _Shift:
    """The change by ``steps`` that took these ``seconds``."""
    jumps = _jumps(seconds, steps)
    dx = dy = farthest = 0.0
    newest_jump = max(jumps, default=-1)
    for number in reversed(range(len(steps))):
        if number not in jumps:
            dx, dy = dx + steps[number][0], dy + steps[number][1]
        if number > newest_jump:
            farthest = max(farthest, math.hypot(dx, dy))
    net, lasted = math.hypot(dx, dy), sum(seconds)
    lasted -= sum(seconds[number] for number in jumps)
    noise = _noise(steps, jumps) if max(farthest, net) > LIMITS.standing_moved else 0.0
    # Bounded, so that noise cannot hide motion: 3 cm to each side count at most.
    within = LIMITS.standing_moved + _NOISES * min(noise, _MOST_NOISE)
    moves = farthest > within or net > within + _JITTER * len(jumps)
    rate = max(0.0, net - min(noise, _MOST_NOISE)) / lasted if moves and lasted else 0.0
    return _Shift(moves, rate, dx, dy, jumps, noise)


def _jumps(
    seconds: Sequence[float], steps: Sequence[tuple[float, float]]
) -> frozenset[int]:
    """The one or two steps that stand out from all others in length and in pace."""
    lengths = [math.hypot(*step) for step in steps]
    longest = max(lengths, default=0.0)
    if longest <= _JITTER:
        return frozenset()
    bound = 2 if sum(map(bool, lengths)) >= _MANY_STEPS else 1
    large = [number for number, step in enumerate(lengths) if step >= longest / 2]
    if len(large) > bound:
        return frozenset()
    dx, dy = sum(step[0] for step in steps), sum(step[1] for step in steps)
    lasted, jumps = sum(seconds), set[int]()
    for number in large:
        others_s = max(lasted - seconds[number], 1e-3)
        other_rate = math.hypot(dx - steps[number][0], dy - steps[number][1]) / others_s
        # After a lost message a step is longer, but at the same pace: no jump.
        if lengths[number] > max(_JITTER, 2.0 * other_rate * seconds[number]):
            jumps.add(number)
    return frozenset(jumps)


def _noise(steps: Sequence[tuple[float, float]], jumps: frozenset[int]) -> float:
    """Noise of a pose (m or rad): median difference of neighbouring steps."""
    unlike = [
        math.hypot(b[0] - a[0], b[1] - a[1])
        for number, (a, b) in enumerate(pairwise(steps))
        if number not in jumps and number + 1 not in jumps
    ]
    return median(unlike) if unlike else 0.0


def _contradiction(
    samples: Sequence[_Sample], place: _Shift, heading: _Shift
) -> Contradiction | None:
    """The gravest contradiction between poses and twists; None: there is none.

    A jump (of place, of heading) proves nothing either way.  So a contradiction counts
    only if it is found with the jumps and without them.
    """
    if not _JUDGED_S[0] <= samples[-1].at - samples[0].at <= _JUDGED_S[1]:
        return None
    codes = _unlike(
        samples,
        place._replace(jumps=frozenset()),
        heading._replace(jumps=frozenset()),
    )
    if codes and (place.jumps or heading.jumps):
        without_jumps = _unlike(samples, place, heading)
        codes = [code for code in codes if code in without_jumps]
    return next(iter(codes), None)


def _unlike(
    samples: Sequence[_Sample], place: _Shift, heading: _Shift
) -> list[Contradiction]:
    """Differences that slip, noise and unknown moments do not explain."""
    forward = sideways = driven = turned = steered = 0.0
    slack_m, slack_rad = (
        LIMITS.standing_moved + _NOISES * shift.noise + _JITTER * len(shift.jumps)
        for shift in (place, heading)
    )
    for number, (a, b) in enumerate(pairwise(samples)):
        half_s = (b.at - a.at) / 2
        if number not in place.jumps:
            yaw, dx, dy = (a.yaw + b.yaw) / 2, b.x - a.x, b.y - a.y
            forward += dx * math.cos(yaw) + dy * math.sin(yaw)
            sideways += dy * math.cos(yaw) - dx * math.sin(yaw)
            driven += (a.linear + b.linear) * half_s
            # A change of speed may be anywhere between two messages.
            slack_m += abs(b.linear - a.linear) * half_s
        if number not in heading.jumps:
            turned += b.yaw - a.yaw
            steered += (a.angular + b.angular) * half_s
            slack_rad += abs(b.angular - a.angular) * half_s
    way_m, way_rad = max(abs(forward), abs(driven)), max(abs(turned), abs(steered))
    codes: list[Contradiction] = []
    if abs(forward - driven) > slack_m + _SLIP_SHARE * way_m:
        codes.append("pose_against_twist")
    if abs(sideways) > slack_m + _SLIP_SHARE * way_m + _BEHIND_M * way_rad:
        codes.append("sideways")
    if abs(turned - steered) > slack_rad + _TURN_SHARE * way_rad:
        codes.append("yaw_against_turn")
    return codes
