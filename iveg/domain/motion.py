"""Motion of one robot, by all that its last second of poses, twists and reports shows.

A word alone proves no rest: wheels slip, localisation dies, and a robot that drives
sideways has no twist that iVeg reads.  So a robot moves as soon as any of the three
shows it, and is as fast as the largest of them::

    twist, report   above 0.02 m/s or rad/s
    pose            changed by more than 0.10 m or rad within a second, in three steps
                    or more: one or two that stand out are jumps of a localisation

Less than six changes a second (odometry through Orion) leave no room for that: there
one step that stands out is a jump, and two alike are motion, so that a robot that is
seen at 2 Hz moves from its second step on.  Of at least three poses however old they
are the last two steps are compared.

Time is the robot's own where it tells it and does not run ahead of ours, else that of
arrival, so that messages in a burst or after a gap show no other motion.
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
_LEAST_POSES, _FORGOTTEN_S = 3, 3.0
_APART_S = 0.08
"""Poses closer together are no steps of their own: thirty a second say no more."""
_JITTER = 0.06
"""A resting pose may step so far: 3 cm (or 0.03 rad) to either side."""
_MOST_NOISE, _NOISES = 0.09, 1.2
"""Noise that counts at most (m, rad), and how often it may look like motion (1)."""
_MANY_STEPS = 6
_AHEAD_S = 10.0
"""A clock that gains more on ours than any message is late tells no time."""
_JUDGED_S = 0.5 - 1e-6, 1.5
"""Poses and twists are compared over so long: of fewer than two a second not at all."""
LASTED_S = 0.3
"""A contradiction that is found has lasted at least so long."""
_SLIP_SHARE, _TURN_SHARE = 0.2, 0.3
"""Wheels slip, and more so in a turn (1)."""
_BEHIND_M = 0.5
"""Farthest that a robot's turning point lies behind ``base_link`` (m)."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of a robot over its last second.

    Attributes:
        speed: Largest that pose, twist or report shows (m/s); ``turn`` (rad/s).
        moves: Any of the three shows motion; ``pose_moves``: the pose does.
        contradiction: Fields of its odometry that contradict each other.
        course: Direction in ``map`` in which the pose goes on (rad); None: as the twist
            says.
        displaced: The pose was farther than 0.10 m away within the last second, by
            motion, noise or a jump: nobody knows yet whether the robot goes on.
    """

    speed: float = 0.0
    turn: float = 0.0
    moves: bool = False
    contradiction: Contradiction | None = None
    pose_moves: bool = False
    course: float | None = None
    displaced: bool = False

    def ahead(self, pose: Pose2D, twist: Twist2D) -> tuple[Pose2D, Twist2D]:
        """Pose and twist to go on with from odometry, at the measured speed."""
        if self.course is not None:
            return Pose2D(pose.x, pose.y, self.course), Twist2D(self.speed, 0.0)
        if self.speed <= abs(twist.linear_x):
            return pose, twist
        speed = math.copysign(self.speed, twist.linear_x)
        return pose, Twist2D(speed, twist.angular_z)


UNMOVED = Motion()


class _Sample(NamedTuple):
    """One odometry; ``at`` on the track's own axis (s), ``yaw`` without wraps (rad)."""

    at: float
    x: float
    y: float
    yaw: float
    linear: float
    angular: float


class _Twist(NamedTuple):
    """Newest speeds of one source and when they were measured (monotonic, s)."""

    linear: float
    angular: float
    at: float


@dataclass(slots=True)
class MotionTrack:
    """Poses, twists and reports of one robot, and the motion that they show.

    Attributes:
        motion: By all that was noted.
    """

    motion: Motion = UNMOVED
    _samples: list[_Sample] = field(default_factory=list)
    _twist: _Twist | None = None
    _report: _Twist | None = None
    _origin: Origin = UNKNOWN_ORIGIN
    _arrived: float = 0.0
    _ahead_s: float = 0.0
    _shown: Motion = UNMOVED
    """Motion by poses alone."""

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
            pose: In ``map``.
            twist: In ``base_link``.
            at: When it was measured, as far as known (monotonic, s).
            origin: Whose count and clock it has.
            arrived: When it came, if that is another moment (monotonic, s).
        """
        self._twist = _Twist(abs(twist.linear_x), abs(twist.angular_z), at)
        arrived = at if arrived is None else arrived
        if pose is not None and self._keep(pose, twist, arrived, origin):
            self._shown = _shown_by(self._samples)
        return self._judge()

    def note_report(self, linear: float, angular: float, at: float) -> Motion:
        """Note what a report says of speed (m/s, rad/s), measured then."""
        self._report = _Twist(abs(linear), abs(angular), at)
        return self._judge()

    def _judge(self) -> Motion:
        said = [one for one in (self._twist, self._report) if one is not None]
        newest = max(one.at for one in said)
        said = [one for one in said if newest - one.at <= WINDOW_S]
        linear = max(one.linear for one in said)
        angular = max(one.angular for one in said)
        shown = self._shown if self._twist in said else UNMOVED
        self.motion = replace(
            shown,
            speed=max(linear, shown.speed),
            turn=max(angular, shown.turn),
            moves=shown.pose_moves or max(linear, angular) >= LIMITS.standing_speed,
        )
        return self.motion

    def _keep(self, pose: Pose2D, twist: Twist2D, arrived: float, of: Origin) -> bool:
        """Keep a pose; returns whether it is so much later that it is a step."""
        samples, at, yaw = self._samples, 0.0, pose.yaw
        if samples:
            last = samples[-1]
            ahead_s, passed_s = self._passed_s(of, arrived - self._arrived)
            if passed_s < _APART_S:
                return False
            at, self._ahead_s = last.at + passed_s, ahead_s
            yaw = last.yaw + wrap_angle(pose.yaw - last.yaw)
        self._origin, self._arrived = of, arrived
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

        By the robot's clock if that can be: it rises, and gains less than a delay.
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
    """Motion that poses alone show, and how their twists contradict them."""
    steps = list(pairwise(samples))
    seconds = [b.at - a.at for a, b in steps]
    place = _shift(seconds, [(b.x - a.x, b.y - a.y) for a, b in steps])
    heading = _shift(seconds, [(b.yaw - a.yaw, 0.0) for a, b in steps])
    contradiction = _contradiction(samples, place, heading)
    moves = place.moves or heading.moves
    course = None
    if place.rate and contradiction in ("pose_against_twist", "sideways"):
        course = math.atan2(place.dy, place.dx)
    newest = samples[-1]
    displaced = any(
        math.hypot(newest.x - one.x, newest.y - one.y) > LIMITS.standing_moved
        for one in samples
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
    """A change of place or heading in the window, jumps left out.

    Attributes:
        moves: It is motion.
        rate: Beyond the noise (m/s, rad/s); 0 where it is none.
        dx: Sum of its steps (m or rad); ``dy`` likewise.
        jumps: Numbers of the steps that are jumps.
        noise: Of the pose (m or rad).
    """

    moves: bool
    rate: float
    dx: float
    dy: float
    jumps: frozenset[int]
    noise: float


def _shift(seconds: Sequence[float], steps: Sequence[tuple[float, float]]) -> _Shift:
    """The change that steps of so many seconds make together."""
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
    # No noise hides much motion: at most that of 3 cm in each direction counts.
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
    most = 2 if sum(map(bool, lengths)) >= _MANY_STEPS else 1
    large = [number for number, one in enumerate(lengths) if one >= longest / 2]
    if len(large) > most:
        return frozenset()
    dx, dy = sum(one[0] for one in steps), sum(one[1] for one in steps)
    lasted, jumps = sum(seconds), set[int]()
    for number in large:
        others_s = max(lasted - seconds[number], 1e-3)
        others = math.hypot(dx - steps[number][0], dy - steps[number][1]) / others_s
        # A message that is missing makes a step longer, and no jump.
        if lengths[number] > max(_JITTER, 2.0 * others * seconds[number]):
            jumps.add(number)
    return frozenset(jumps)


def _noise(steps: Sequence[tuple[float, float]], jumps: frozenset[int]) -> float:
    """Noise of a pose (m or rad): how unlike neighbouring steps are, in the median."""
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

    A jump (of place, of heading) proves nothing either way, so that it has to be found
    with the jumps and without them.
    """
    if not _JUDGED_S[0] <= samples[-1].at - samples[0].at <= _JUDGED_S[1]:
        return None
    none = frozenset[int]()
    found = _unlike(samples, place._replace(jumps=none), heading._replace(jumps=none))
    if found and (place.jumps or heading.jumps):
        without = _unlike(samples, place, heading)
        found = [code for code in found if code in without]
    return next(iter(found), None)


def _unlike(
    samples: Sequence[_Sample], place: _Shift, heading: _Shift
) -> list[Contradiction]:
    """Differences that slip, noise and unknown moments do not explain."""
    forward = sideways = driven = turned = steered = 0.0
    slack_m, slack_rad = (
        LIMITS.standing_moved + _NOISES * one.noise + _JITTER * len(one.jumps)
        for one in (place, heading)
    )
    for number, (a, b) in enumerate(pairwise(samples)):
        half_s = (b.at - a.at) / 2
        if number not in place.jumps:
            yaw, dx, dy = (a.yaw + b.yaw) / 2, b.x - a.x, b.y - a.y
            forward += dx * math.cos(yaw) + dy * math.sin(yaw)
            sideways += dy * math.cos(yaw) - dx * math.sin(yaw)
            driven += (a.linear + b.linear) * half_s
            # Nobody knows when between two messages a speed changed.
            slack_m += abs(b.linear - a.linear) * half_s
        if number not in heading.jumps:
            turned += b.yaw - a.yaw
            steered += (a.angular + b.angular) * half_s
            slack_rad += abs(b.angular - a.angular) * half_s
    way_m, way_rad = max(abs(forward), abs(driven)), max(abs(turned), abs(steered))
    found: list[Contradiction] = []
    if abs(forward - driven) > slack_m + _SLIP_SHARE * way_m:
        found.append("pose_against_twist")
    if abs(sideways) > slack_m + _SLIP_SHARE * way_m + _BEHIND_M * way_rad:
        found.append("sideways")
    if abs(turned - steered) > slack_rad + _TURN_SHARE * way_rad:
        found.append("yaw_against_turn")
    return found
