"""The world as iVeg knows it: every robot with the age of everything about it.

``World.apply`` takes one observation; older ones and twins change nothing and are
counted.  Nothing here reads a clock: ages come from the ``now`` that is handed in.
"""

from bisect import bisect_left
from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from math import inf
from typing import Literal

from iveg.domain.age import FeedbackLedger
from iveg.domain.clocks import RobotClock
from iveg.domain.errors import UnknownRobotError
from iveg.domain.feeds import Feeds
from iveg.domain.fleet import FleetDescription, RobotDescription, RobotProfile
from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    Climate,
    CommandAnswer,
    CommandStatus,
    DetectionFrame,
    HeartbeatProbe,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    Overtaken,
    Received,
    SafetyReport,
    kind_of,
)
from iveg.domain.order import Order, Verdict
from iveg.domain.probe import ProbeLag
from iveg.domain.transports import FIWARE, TransportId

Link = Literal["UNKNOWN", "LIVE", "LATE", "LOST"]

_HISTORY = 128
_ASKED_AGE_S, _THINNED_AGE_S = LIMITS.late_s + 0.1, LIMITS.live_s + 0.1
GAIN_OVER_S = 1.0


@dataclass(frozen=True, slots=True)
class Sensed:
    """The newest of one kind, and the moment it was not measured before.

    Attributes:
        at: None while nobody knows.
    """

    observation: Observation
    at: Instant | None


@dataclass(slots=True)
class RobotState:
    """What is known of one robot.

    Attributes:
        pose_at: The newest odometry was not measured before this moment (monotonic,
            s): proven if the robot echoes, else estimated; None while neither is.
        estimated_since: When odometry first came that proves nothing, if the newest
            does not (monotonic, s).
        unproven_since: When odometry first came whose age nobody knows (monotonic, s).
        heard_at: Arrival of the newest message of any kind (monotonic, s).
        detections_at: Like ``pose_at``, of the newest detection frame.
        sighted_at: The same of the frame that was taken last, newest or not; where
            nothing is known, the moment that is likely.
        scan_received: Like ``pose_at``, of the newest scan; ``safety_received`` too.
        unreadable_at: When a detection last could not be used (monotonic, s).
        live_at: When a live safety node last spoke for a robot that the fleet calls a
            recording (monotonic, s): from then on it counts as live.
        refused_at: When a message that calls itself a replay was last refused, because
            the robot is live (monotonic, s).
        map_frame: Of a recording, the frame that its messages name.
        sensed: The newest of each kind that has no member of its own.
    """

    robot_id: str
    description: RobotDescription
    odometry: Odometry | None = None
    odometry_received: Instant | None = None
    pose_at: float | None = None
    estimated_since: float | None = None
    unproven_since: float | None = None
    scan: LaserScan | None = None
    scan_pose: Pose2D | None = None
    scan_received: Instant | None = None
    frame: DetectionFrame | None = None
    frame_transport: TransportId = FIWARE.id
    detections_at: float | None = None
    sighted_at: Instant | None = None
    unreadable_at: float | None = None
    safety: SafetyReport | None = None
    safety_received: Instant | None = None
    navigation: Navigation | None = None
    navigation_received: Instant | None = None
    command_status: str | None = None
    heard_at: float | None = None
    live_at: float | None = None
    refused_at: float | None = None
    map_frame: str | None = None
    sensed: dict[type[Observation], Sensed] = field(default_factory=dict)
    clock: RobotClock = field(default_factory=RobotClock)
    _orders: dict[type[Observation], Order] = field(default_factory=dict)
    _poses: deque[tuple[float, Pose2D]] = field(
        default_factory=lambda: deque(maxlen=_HISTORY)
    )
    _speeds: deque[tuple[float, float]] = field(
        default_factory=lambda: deque(maxlen=_HISTORY)
    )

    def age_s(self, now: Instant) -> float | None:
        """Age of the pose at most (s); None before the first, and while unknown."""
        return None if self.pose_at is None else max(0.0, now.mono - self.pose_at)

    def likely_pose_at(self) -> float | None:
        """``pose_at``; where nobody knows it, when the pose came (monotonic, s)."""
        if self.pose_at is None and self.odometry_received is not None:
            return self.odometry_received.mono
        return self.pose_at

    def link(self, now: Instant) -> Link:
        """LIVE, LATE or LOST by the age of the pose (docs/safety.md, "Age")."""
        age = self.age_s(now)
        if age is None:
            since = self.unproven_since
            lost = since is not None and now.mono - since > LIMITS.late_s
            return "LOST" if lost else "UNKNOWN"
        if age <= LIMITS.live_s:
            return "LIVE"
        return "LATE" if age <= LIMITS.late_s else "LOST"

    @property
    def profile(self) -> RobotProfile:
        """What this robot is."""
        return self.description.profile

    @property
    def is_replay(self) -> bool:
        """Whether a recording plays this robot: by the fleet, while no live one speaks.

        What a robot calls its task has no say in it.
        """
        return self.description.kind == "recording" and self.live_at is None

    @property
    def recording(self) -> str | None:
        """The map frame of a recording: its own unless told; None for a live robot."""
        return (self.map_frame or self.robot_id) if self.is_replay else None

    @property
    def stands(self) -> bool:
        """Whether the newest odometry shows no motion."""
        if self.odometry is None:
            return False
        twist = self.odometry.twist
        return (
            abs(twist.linear_x) < LIMITS.standing_speed
            and abs(twist.angular_z) < LIMITS.standing_speed
        )

    def pose_at_stamp(self, stamp_s: float | None) -> Pose2D | None:
        """The pose at a moment of the robot's own clock (s), interpolated.

        Outside the short history the nearest end counts; without a stamp the newest.
        """
        poses = self._poses
        if not poses:
            return None
        if stamp_s is None or stamp_s >= poses[-1][0]:
            return poses[-1][1]
        index = bisect_left(poses, stamp_s, key=lambda entry: entry[0])
        if index == 0:
            return poses[0][1]
        (before, earlier), (after, later) = poses[index - 1], poses[index]
        return earlier.interpolate(later, (stamp_s - before) / (after - before))

    def speed_gained(self) -> float:
        """How much faster it is than in the mean of its last second (m/s)."""
        if self.odometry is None or not self._speeds:
            return 0.0
        mean = sum(speed for _, speed in self._speeds) / len(self._speeds)
        return abs(self.odometry.twist.linear_x) - mean

    def remember_speed(self, at: float, speed: float) -> None:
        """Keep a speed (m/s) for a second; ``at`` monotonic (s)."""
        self._speeds.append((at, abs(speed)))
        while at - self._speeds[0][0] > GAIN_OVER_S:
            self._speeds.popleft()

    def judge(
        self, observation: Observation, origin: Origin, *, asked: bool = False
    ) -> Verdict:
        """Place a message in its stream's order.

        What Orion kept of an earlier boot must not make the present one look old.
        """
        kind = kind_of(observation)
        order = self._orders.get(kind)
        if order is None:
            order = self._orders[kind] = Order()
        if asked and order.knows_better_than(origin):
            return "late"
        return order.judge(origin)

    def is_past(self, kind: type[Observation], boot: str, seq: int) -> bool:
        """Whether a message of this identity cannot be news.

        What a late look saw may still protect somebody: only its twin is past.
        """
        order = self._orders.get(kind)
        if order is None:
            return False
        is_look = kind is DetectionFrame
        return order.is_twin(boot, seq) if is_look else order.is_past(boot, seq)

    def is_newest(self, kind: type[Observation], origin: Origin) -> bool:
        """Whether nothing newer than this message is known."""
        order = self._orders.get(kind)
        return order is not None and (order.boot, order.seq) == (
            origin.boot,
            origin.seq,
        )

    def forget_poses(self) -> None:
        """Nothing that was kept for ``pose_at_stamp`` counts any more."""
        self._poses.clear()

    def remember_pose(self, moment: float, pose: Pose2D) -> None:
        """Keep a pose for ``pose_at_stamp``; a clock that jumps back starts anew."""
        if self._poses and moment <= self._poses[-1][0]:
            if self._poses[-1][0] - moment > 1.0:
                self._poses.clear()
            else:
                return
        self._poses.append((moment, pose))


class World:
    """All robots of the fleet and the air around them.

    Args:
        fleet: Who is in it; ids alone are robots that nobody described.
        probe: Tells how late FIWARE is; without one nobody asks.

    Attributes:
        ledger: When iVeg's own feedback was composed, which robots echo.
    """

    def __init__(
        self, fleet: FleetDescription | Iterable[str], probe: ProbeLag | None = None
    ) -> None:
        self.ledger = FeedbackLedger()
        self._probe = probe
        if not isinstance(fleet, FleetDescription):
            fleet = FleetDescription.undescribed(fleet)
        self.robots = {
            robot_id: RobotState(robot_id, one)
            for robot_id, one in fleet.members.items()
        }
        self.climate: Climate | None = None
        self.climate_received: Instant | None = None
        self.heartbeat_at: float | None = None
        self.counters: Counter[str] = Counter()
        self.feeds = Feeds()

    def robot(self, robot_id: str) -> RobotState:
        """One robot.

        Raises:
            UnknownRobotError: not in the fleet.
        """
        try:
            return self.robots[robot_id]
        except KeyError:
            raise UnknownRobotError(robot_id) from None

    def is_past(
        self, robot_id: str, kind: type[Observation], boot: str, seq: int
    ) -> bool:
        """Whether a message can be told by its identity to be old or a twin."""
        robot = self.robots.get(robot_id)
        return robot is not None and robot.is_past(kind, boot, seq)

    def apply(self, received: Received) -> Verdict:
        """Take one observation in.

        Returns:
            ``new`` when it became the state, else why it did not.

        Raises:
            UnknownRobotError: from a robot that is not in the fleet.
        """
        observation, at = received.observation, received.at
        if isinstance(observation, Climate | HeartbeatProbe):
            self._note(observation, at)
            return "new"
        robot = self.robot(observation.robot_id)
        origin = getattr(observation, "origin", Origin())
        if self.refuses(received):
            # What Orion kept may be of a time when the robot was a recording.
            robot.refused_at = robot.refused_at if received.asked else at.mono
            self.counters[f"{kind_of(observation).__name__}.refused"] += 1
            return "refused"
        _tell_kind(robot, received, origin)
        verdict = robot.judge(observation, origin, asked=received.asked)
        if isinstance(observation, Overtaken) and verdict == "new":
            # Its stream was past it, and has since met sixteen other boots.
            verdict = "late"
        if not received.asked:
            verdict = self._fed(robot, received, origin, verdict)
        self.counters[f"{kind_of(observation).__name__}.{verdict}"] += 1
        if verdict == "duplicate" or (received.asked and origin.seq is None):
            return "duplicate"
        if not received.asked:
            robot.heard_at = at.mono
        likely = self._likely_age(robot, received, origin)
        if isinstance(observation, DetectionFrame):
            seen_at = self._measured_at(origin, received, likely)
            if seen_at is None:
                # A person counts, though nobody can prove how fresh the look is.
                seen_at = at.mono - (likely or 0.0)
            robot.sighted_at = _dated(at, seen_at)
        if verdict == "new":
            _update(robot, received, self._measured_at(origin, received, likely))
        return verdict

    def _note(self, observation: Climate | HeartbeatProbe, at: Instant) -> None:
        """What no robot says."""
        if isinstance(observation, Climate):
            self.climate, self.climate_received = observation, at
        else:
            self.heartbeat_at = at.mono

    def refuses(self, received: Received) -> bool:
        """Whether a message calls itself a replay while its robot is live.

        Nothing of it counts: whoever plays it is not that robot.
        """
        observation = received.observation
        if getattr(observation, "origin", Origin()).replay is None:
            return False
        robot_id = getattr(observation, "robot_id", None)
        robot = None if robot_id is None else self.robots.get(robot_id)
        return robot is not None and not robot.is_replay

    def _likely_age(
        self, robot: RobotState, received: Received, origin: Origin
    ) -> float | None:
        """How old a message was when it came, by its stamp and our probe (s)."""
        at = received.at
        if received.asked:
            return _age_when_asked(origin, at)
        lag: float | None = 0.0
        if self._probe is not None:
            lag = self._probe.lag(at) if self._probe.is_known else None
        kind = kind_of(received.observation)
        return robot.clock.delay(kind, origin, at, received.transport, lag)

    def _measured_at(
        self, origin: Origin, received: Received, likely: float | None
    ) -> float | None:
        """The moment that a message was not measured before (monotonic, s).

        Of a robot that echoes only a proof counts.
        """
        now = received.at.mono
        moment = None if likely is None else now - likely
        if origin.acknowledgements:
            moment = self.ledger.composed_at(origin.heard)
        if moment is None:
            return None
        least = _THINNED_AGE_S if received.thinned else 0.0
        return min(moment, now - (_ASKED_AGE_S if received.asked else least))

    def age_then(self, received: Received) -> float:
        """How old the newest of its kind was at most when it came (s).

        Infinite where nobody knows, and for odometry whose age is only estimated: an
        estimate proves nothing.
        """
        observation, moment = received.observation, None
        if isinstance(observation, SafetyReport):
            reported = self.robot(observation.robot_id).safety_received
            moment = None if reported is None else reported.mono
        elif isinstance(observation, Odometry):
            robot = self.robot(observation.robot_id)
            moment = robot.pose_at if robot.estimated_since is None else None
        return inf if moment is None else max(0.0, received.at.mono - moment)

    def _fed(
        self, robot: RobotState, received: Received, origin: Origin, verdict: Verdict
    ) -> Verdict:
        """Note which transport brought it; without a count the direct copy wins."""
        kind = kind_of(received.observation)
        if kind not in (Odometry, LaserScan):
            return verdict
        feed = self.feeds.of(robot.robot_id, kind)
        at, counted = received.at.mono, origin.seq is not None
        if received.transport == FIWARE.id and not counted and feed.is_direct(at):
            verdict = "duplicate"
        is_direct = received.transport != FIWARE.id
        abreast = is_direct and robot.is_newest(kind, origin)
        feed.heard(received.transport, at, news=verdict == "new" or abreast)
        return verdict

    def live_robots(self) -> Iterable[RobotState]:
        """Robots that are not recordings."""
        return (robot for robot in self.robots.values() if not robot.is_replay)


def _tell_kind(robot: RobotState, received: Received, origin: Origin) -> None:
    """Learn of a recording which frame it is in, and whether it is none at all.

    Orion's answer may be of a time when the robot was live; a safety node that speaks
    now is live unless it says that it plays a recording.
    """
    if robot.description.kind == "live" or received.asked:
        return
    if origin.replay is not None:
        robot.map_frame = origin.replay
    elif isinstance(received.observation, SafetyReport | CommandAnswer):
        robot.live_at = received.at.mono


def _age_when_asked(origin: Origin, at: Instant) -> float:
    """How old Orion's answer is at least (s): nothing that was asked for looks live."""
    told = 0.0 if origin.stamp_s is None else at.wall - origin.stamp_s
    return max(told, _ASKED_AGE_S)


def _update(robot: RobotState, received: Received, moment: float | None) -> None:
    """Take the newest of its kind in; ``moment`` is when it was measured, or None."""
    observation, at = received.observation, received.at
    match observation:
        case Odometry():
            _drive(robot, observation, at, moment)
        case LaserScan():
            robot.scan, robot.scan_received = observation, _dated(at, moment)
            robot.scan_pose = robot.pose_at_stamp(observation.origin.own_s)
        case DetectionFrame():
            _see(robot, observation, received, moment)
        case SafetyReport():
            _hear(robot, observation, received, moment)
        case Navigation():
            robot.navigation, robot.navigation_received = observation, at
        case CommandStatus():
            robot.command_status = observation.status
        case CommandAnswer():
            pass  # an event: the machine of its command takes it
        case _:
            robot.sensed[type(observation)] = Sensed(observation, _dated(at, moment))


def _see(
    robot: RobotState, frame: DetectionFrame, received: Received, moment: float | None
) -> None:
    """Take the newest detection frame in."""
    robot.detections_at = _not_before(
        robot.detections_at, robot.frame, frame.origin, moment
    )
    robot.frame, robot.frame_transport = frame, received.transport
    if frame.unreadable:
        robot.unreadable_at = received.at.mono


def _hear(
    robot: RobotState, report: SafetyReport, received: Received, moment: float | None
) -> None:
    """Take the newest safety report in."""
    known = robot.safety_received
    before = None if known is None else known.mono
    moment = _not_before(before, robot.safety, report.origin, moment)
    robot.safety, robot.safety_received = report, _dated(received.at, moment)


def _drive(
    robot: RobotState, odometry: Odometry, at: Instant, moment: float | None
) -> None:
    """Take the newest odometry in."""
    origin, pose, before = odometry.origin, odometry.pose, robot.odometry
    moment = _not_before(robot.pose_at, before, origin, moment)
    robot.pose_at = moment
    robot.unproven_since = _since(robot.unproven_since, at, holds=moment is None)
    robot.estimated_since = _since(
        robot.estimated_since, at, holds=not origin.acknowledgements
    )
    robot.odometry, robot.odometry_received = odometry, at
    if before is not None and before.origin.boot != origin.boot:
        robot.forget_poses()  # another boot counts its seconds anew
    robot.remember_pose(at.wall if origin.own_s is None else origin.own_s, pose)
    likely = at.mono if moment is None else moment
    robot.remember_speed(likely, odometry.twist.linear_x)


def _since(before: float | None, at: Instant, *, holds: bool) -> float | None:
    """When something began that holds now (monotonic, s)."""
    if not holds:
        return None
    return at.mono if before is None else before


def _not_before(
    known: float | None,
    before: Odometry | DetectionFrame | SafetyReport | None,
    origin: Origin,
    moment: float | None,
) -> float | None:
    """The moment of the newest; it was measured after the one before it was.

    That holds within a boot, and where messages are counted.
    """
    if known is None or before is None:
        return moment
    if origin.seq is None or origin.boot is None or origin.boot != before.origin.boot:
        return moment
    return known if moment is None else max(known, moment)


def _dated(at: Instant, moment: float | None) -> Instant | None:
    """A monotonic moment on both clocks."""
    return None if moment is None else at.later(moment - at.mono)
