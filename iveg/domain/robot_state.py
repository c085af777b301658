"""One robot as iVeg knows it: newest observations with their age, doubts and obedience.

Nothing here reads a clock: ages come from the ``now`` that is handed in.
"""

from bisect import bisect_left
from collections import defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

from iveg.domain.clocks import RobotClock
from iveg.domain.detector import DetectorEvidence
from iveg.domain.feedback import HALF_SPEED, SpeedLimit
from iveg.domain.fleet import RobotDescription, RobotProfile
from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.domain.motion import Motion, MotionTrack
from iveg.domain.observations import (
    CommandAnswer,
    CommandStatus,
    DetectionFrame,
    GoalAnswer,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    Received,
    SafetyReport,
    kind_of,
)
from iveg.domain.stream_order import OrderVerdict, PresentBoot, StreamOrder
from iveg.domain.transports import FIWARE, TransportId


class _Spell(NamedTuple):
    """From the first to the newest contradiction of one code (monotonic, s)."""

    began: float
    newest: float


@dataclass(slots=True)
class Doubts:
    """Contradictions of one robot with itself or physics, by code.

    ::

        consistent ── contradicted for longer than a round trip ──> doubted
                   <── nothing of it contradicted for a second ────

    A doubt lowers speeds and never raises one (docs/safety.md, "Clear").
    """

    _spells: dict[str, _Spell] = field(default_factory=dict)

    def contradicted(self, code: str, now: Instant, lasted_s: float = 0.0) -> None:
        """Note a contradiction of this code, which has lasted so long if it is new."""
        spell = self._spells.get(code)
        if spell is None or self._is_over(spell, now):
            spell = _Spell(now.mono - lasted_s, now.mono)
        self._spells[code] = _Spell(spell.began, now.mono)

    def active(self, now: Instant) -> tuple[str, ...]:
        """Codes of the doubts that count now, the oldest first."""
        if not self._spells:
            return ()
        return tuple(
            code
            for code, spell in self._spells.items()
            if spell.newest - spell.began > LIMITS.round_trip_s
            and not self._is_over(spell, now)
        )

    def is_open(self, now: Instant) -> bool:
        """Whether anything is contradicted, however shortly."""
        return not all(self._is_over(one, now) for one in self._spells.values())

    @staticmethod
    def _is_over(spell: _Spell, now: Instant) -> bool:
        return now.mono - spell.newest > LIMITS.doubt_ends_s


Link = Literal["UNKNOWN", "LIVE", "LATE", "LOST"]

_HISTORY = 128


@dataclass(frozen=True, slots=True)
class Sensed:
    """The newest observation of one kind, and the earliest moment it can be of.

    Attributes:
        at: None while nobody knows.
    """

    observation: Observation
    at: Instant | None


@dataclass(slots=True)
class RobotState:
    """The known state of one robot.

    Attributes:
        pose_at: The newest odometry was not measured before this moment (monotonic,
            s): proven if the robot echoes, else estimated; None while neither is.
        estimated_since: When odometry first came that proves nothing, if the newest
            does not (monotonic, s).
        unproven_since: When odometry first came whose age nobody knows (monotonic, s).
        alive_since: When odometry came again after a silence (monotonic, s).
        heard_at: Arrival of the newest message of any kind (monotonic, s).
        heard_since: Since when odometry or reports have come without a silence, by the
            moments at which they were measured; ``heard_until`` (monotonic, s).
        detections_at: Like ``pose_at``, of the newest detection frame.
        sighted_at: The same of the frame that was taken last, newest or not; where
            nothing is known, the moment that is likely.
        scan_received: Like ``pose_at``, of the newest scan; ``safety_received`` too.
        detector: Whether its pictures are read whole.
        refused: Whether a setting says that it is not heard.
        unlabelled: Whether boxes of its newest frame with any came without a frame.
        live_at: When a live safety node last spoke for a robot that the fleet calls a
            recording (monotonic, s): from then on it counts as live.
        refused_at: When a message that calls itself a replay was last refused, because
            the robot is live (monotonic, s).
        map_frame: Of a recording, the frame that its messages name.
        sensed: The newest of each kind that has no member of its own.
        doubts: What it says that contradicts itself or physics.
        trusted_pose: The newest pose from before anything was contradicted.
        present_boot: Which messages are proven to be of no earlier boot.
        track: By which its motion is known.
    """

    robot_id: str
    description: RobotDescription
    odometry: Odometry | None = None
    odometry_received: Instant | None = None
    odometry_transport: TransportId = FIWARE.id
    pose_at: float | None = None
    estimated_since: float | None = None
    unproven_since: float | None = None
    alive_since: float | None = None
    scan: LaserScan | None = None
    scan_pose: Pose2D | None = None
    scan_received: Instant | None = None
    frame: DetectionFrame | None = None
    frame_transport: TransportId = FIWARE.id
    detections_at: float | None = None
    sighted_at: Instant | None = None
    detector: DetectorEvidence = field(default_factory=DetectorEvidence)
    refused: bool = False
    unlabelled: bool = False
    safety: SafetyReport | None = None
    safety_received: Instant | None = None
    navigation: Navigation | None = None
    navigation_received: Instant | None = None
    command_status: str | None = None
    heard_at: float | None = None
    heard_since: float = float("-inf")
    heard_until: float = float("-inf")
    live_at: float | None = None
    refused_at: float | None = None
    map_frame: str | None = None
    sensed: dict[type[Observation], Sensed] = field(default_factory=dict)
    doubts: Doubts = field(default_factory=Doubts)
    trusted_pose: Pose2D | None = None
    clock: RobotClock = field(default_factory=RobotClock)
    present_boot: PresentBoot = field(default_factory=PresentBoot)
    track: MotionTrack = field(default_factory=MotionTrack)
    _orders: defaultdict[type[Observation], StreamOrder] = field(
        default_factory=lambda: defaultdict(StreamOrder)
    )
    _poses: deque[tuple[float, Pose2D]] = field(
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

    def possible_poses(self) -> tuple[Pose2D, ...]:
        """Where it may be: where it says, and where it was before it was doubted."""
        said = () if self.odometry is None else (self.odometry.pose,)
        return said if self.trusted_pose is None else (*said, self.trusted_pose)

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

    def is_believed(self, now: Instant) -> bool:
        """Whether its word counts against another's: LIVE, and nothing contradicted."""
        return self.link(now) == "LIVE" and not self.doubts.is_open(now)

    @property
    def profile(self) -> RobotProfile:
        """The robot's profile."""
        return self.description.profile

    @property
    def is_replay(self) -> bool:
        """Whether a recording plays this robot: by the fleet, while no live one sends.

        The name of its task does not count.
        """
        return self.description.kind == "recording" and self.live_at is None

    @property
    def recording(self) -> str | None:
        """The map frame of a recording: its own where it names none; None: live."""
        return (self.map_frame or self.robot_id) if self.is_replay else None

    @property
    def stands(self) -> bool:
        """Whether its odometry is known, and nothing shows motion."""
        return self.odometry is not None and not self.track.motion.moves

    def motion(self, now: Instant) -> Motion:
        """Its motion in the last second before it was silent."""
        motion, received = self.track.motion, self.odometry_received
        if motion.contradiction is None or received is None:
            return motion
        is_old = now.mono - received.mono > LIMITS.silence_s
        return replace(motion, contradiction=None) if is_old else motion

    def pose_at_stamp(self, stamp_s: float | None) -> Pose2D | None:
        """The pose at a moment of the robot's own clock (s), interpolated.

        Outside the short history the nearest end counts; without a stamp the newest,
        and for one that is so old that it is of another clock.
        """
        poses = self._poses
        if not poses:
            return None
        newest_s = poses[-1][0]
        if stamp_s is None or not newest_s - LIMITS.zone_lasts_s <= stamp_s < newest_s:
            return poses[-1][1]
        index = bisect_left(poses, stamp_s, key=lambda entry: entry[0])
        if index == 0:
            return poses[0][1]
        (before, earlier), (after, later) = poses[index - 1], poses[index]
        return earlier.interpolate(later, (stamp_s - before) / (after - before))

    def note_heard(self, moment: float) -> None:
        """Note odometry or a report that was measured then (monotonic, s)."""
        if moment - self.heard_until > LIMITS.silence_s:
            self.heard_since = moment
        self.heard_until = max(self.heard_until, moment)

    def heard_for_s(self, since: float) -> float:
        """Time in which it was heard without a silence since a moment (s)."""
        return self.heard_until - max(since, self.heard_since)

    def received_at(self, kind: type[Observation]) -> Instant | None:
        """When the newest of a kind came in; None: never."""
        members = {
            Odometry: self.odometry_received,
            LaserScan: self.scan_received,
            DetectionFrame: self.sighted_at,
            SafetyReport: self.safety_received,
            Navigation: self.navigation_received,
        }
        sensed = self.sensed.get(kind)
        return members.get(kind) if sensed is None else sensed.at

    def judge(
        self, received: Received, origin: Origin, proven_at: float | None
    ) -> OrderVerdict:
        """Place a message in its stream's order.

        A message of an earlier boot, which Orion kept or which its echo proves to be
        one, must not make the present boot look old.  ``proven_at``: when the feedback
        that it echoes was composed (monotonic, s); None where that proves nothing.
        """
        order, is_earlier = self._orders[kind_of(received.observation)], received.asked
        if proven_at is not None:
            self.present_boot.meet(origin.boot, proven_at)
            is_earlier |= self.present_boot.is_past(origin.boot, proven_at)
        if is_earlier and order.knows_better_than(origin):
            return "late"
        return order.judge(origin, received.at.mono, proven_at)

    def is_newest(self, kind: type[Observation], origin: Origin) -> bool:
        """Whether nothing newer than this message is known."""
        order = self._orders.get(kind)
        return order is not None and (order.boot, order.seq) == (
            origin.boot,
            origin.seq,
        )

    def forget_poses(self) -> None:
        """Drop every pose that was kept for ``pose_at_stamp``."""
        self._poses.clear()

    def remember_pose(self, moment: float, pose: Pose2D) -> None:
        """Keep a pose for ``pose_at_stamp``; a clock that jumps back starts anew."""
        if self._poses and moment <= self._poses[-1][0]:
            if self._poses[-1][0] - moment > 1.0:
                self._poses.clear()
            else:
                return
        self._poses.append((moment, pose))


def learn_kind(robot: RobotState, received: Received, origin: Origin) -> None:
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


def apply_newest(robot: RobotState, received: Received, moment: float | None) -> None:
    """Take the newest of its kind in; ``moment`` is when it was measured, or None."""
    observation, at = received.observation, received.at
    if isinstance(observation, Odometry | SafetyReport) and not received.asked:
        robot.note_heard(at.mono if moment is None else moment)
    match observation:
        case Odometry():
            _drive(robot, observation, received, moment)
        case LaserScan():
            robot.scan, robot.scan_received = observation, dated(at, moment)
            robot.scan_pose = robot.pose_at_stamp(observation.origin.own_s)
        case DetectionFrame():
            _see(robot, observation, received, moment)
        case SafetyReport():
            _hear(robot, observation, received, moment)
        case Navigation():
            robot.navigation, robot.navigation_received = observation, at
        case CommandStatus():
            robot.command_status = observation.status
        case CommandAnswer() | GoalAnswer():
            pass  # an event: the machine of its command takes it
        case _:
            robot.sensed[type(observation)] = Sensed(observation, dated(at, moment))


def _see(
    robot: RobotState, frame: DetectionFrame, received: Received, moment: float | None
) -> None:
    """Take the newest detection frame in."""
    robot.detections_at = _not_before(
        robot.detections_at, robot.frame, frame.origin, moment
    )
    robot.frame, robot.frame_transport = frame, received.transport
    if frame.detections:
        robot.unlabelled = any(one.frame_id is None for one in frame.detections)


def _hear(
    robot: RobotState, report: SafetyReport, received: Received, moment: float | None
) -> None:
    """Take the newest safety report in."""
    known = robot.safety_received
    before = None if known is None else known.mono
    moment = _not_before(before, robot.safety, report.origin, moment)
    robot.safety, robot.safety_received = report, dated(received.at, moment)
    if not received.asked:
        likely = received.at.mono if moment is None else moment
        robot.track.note_report(report.linear, report.angular, likely)


def _drive(
    robot: RobotState, odometry: Odometry, received: Received, moment: float | None
) -> None:
    """Take the newest odometry in."""
    at = received.at
    origin, pose, before = odometry.origin, odometry.pose, robot.odometry
    moment = _not_before(robot.pose_at, before, origin, moment)
    robot.pose_at = moment
    robot.unproven_since = _since(robot.unproven_since, at, holds=moment is None)
    robot.estimated_since = _since(
        robot.estimated_since, at, holds=not origin.acknowledgements
    )
    if before is not None and not (robot.trusted_pose and robot.doubts.is_open(at)):
        robot.trusted_pose = before.pose
    heard = robot.odometry_received
    if heard is None or at.mono - heard.mono > LIMITS.silence_s:
        robot.alive_since = at.mono
    robot.odometry, robot.odometry_received = odometry, at
    robot.odometry_transport = received.transport
    if before is not None and before.origin.boot != origin.boot:
        robot.forget_poses()  # another boot counts its seconds anew
    robot.remember_pose(at.wall if origin.own_s is None else origin.own_s, pose)
    likely = at.mono if moment is None else moment
    if not received.asked:
        robot.track.note_odometry(pose, odometry.twist, likely, origin, at.mono)


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
    """The moment of the newest message, which was measured after the one before it.

    That holds within a boot, and where messages are counted.
    """
    if known is None or before is None:
        return moment
    if origin.seq is None or origin.boot is None or origin.boot != before.origin.boot:
        return moment
    return known if moment is None else max(known, moment)


def dated(at: Instant, moment: float | None) -> Instant | None:
    """A monotonic moment on both clocks."""
    return None if moment is None else at.later(moment - at.mono)


SLOW_SHARE = 0.55
"""Half speed, and what a drive and its odometry are off (of the greatest speed)."""
_LEAST_S, _BEYOND_BRAKING_S = 1.5, 0.5
_FAST_FOR_S = 0.5
"""A robot that is faster for less time has only been measured so."""


def slow_below(profile: RobotProfile) -> float:
    """Speed up to which a robot counts as slow (m/s)."""
    return SLOW_SHARE * profile.max_speed


def allowed_s(profile: RobotProfile) -> float:
    """Time that a robot may take to obey (s)."""
    halves_s = (1.0 - HALF_SPEED) * profile.max_speed / profile.assumed_braking
    return max(_LEAST_S, halves_s + _BEYOND_BRAKING_S)


class Obedience:
    """Obedience of robots to their limits, measured in their motion.

    It is watched apart from decisions, since zones come and go while a robot that hears
    nothing drives on, and whatever the robot reports.  A standing robot is obedient.

    Only time counts in which a robot was heard, by the moments of measurement
    (monotonic, s): what comes late accuses nobody, and a silence begins it anew.
    """

    def __init__(self) -> None:
        self._told: dict[str, tuple[float, SpeedLimit]] = {}
        self._fast_since: dict[str, float] = {}

    def published(self, limits: Mapping[str, SpeedLimit], now: Instant) -> None:
        """Note the limits of a feedback that was sent to the fleet."""
        for robot_id, limit in limits.items():
            if limit.speed_factor > HALF_SPEED:
                self._told.pop(robot_id, None)
                continue
            since, _ = self._told.get(robot_id, (now.mono, limit))
            self._told[robot_id] = since, limit

    def ignored(self, robot: RobotState, now: Instant) -> SpeedLimit | None:
        """The limit that a robot does not keep to; None: it does, or nobody knows."""
        robot_id = robot.robot_id
        if robot.motion(now).speed <= slow_below(robot.profile):
            self._fast_since.pop(robot_id, None)
            return None
        fast_since = self._fast_since.setdefault(robot_id, robot.heard_until)
        since, limit = self._told.get(robot_id, (now.mono, None))
        is_late = robot.heard_for_s(since) > allowed_s(robot.profile)
        is_fast = robot.heard_for_s(fast_since) >= _FAST_FOR_S
        return limit if is_late and is_fast else None
