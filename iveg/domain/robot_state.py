"""One robot as iVeg knows it: newest observations with their age, doubts and obedience.

Nothing here reads a clock: ages are measured from the argument ``now``.
"""

import math
from bisect import bisect_left
from collections import defaultdict, deque
from collections.abc import Mapping, Sequence
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
from iveg.domain.stream_order import Freshness, PresentBoot, StreamOrder
from iveg.domain.transports import FIWARE, TransportId


class _Spell(NamedTuple):
    """Time from the first to the newest contradiction of one code (monotonic, s)."""

    began: float
    newest: float


@dataclass(slots=True)
class Doubts:
    """Contradictions of one robot with itself or physics, by code.

    ::

        consistent ── contradicted for longer than a round trip ──> doubted
                   <── no contradiction for a second ────

    A doubt lowers speeds and never raises one (docs/safety.md, "Clear").
    """

    _spells: dict[str, _Spell] = field(default_factory=dict)

    def contradicted(self, code: str, now: Instant, lasted_s: float = 0.0) -> None:
        """Note a contradiction; a new one has already lasted for ``lasted_s``."""
        spell = self._spells.get(code)
        if spell is None or self._is_over(spell, now):
            spell = _Spell(now.mono - lasted_s, now.mono)
        self._spells[code] = _Spell(spell.began, now.mono)

    def active(self, now: Instant) -> tuple[str, ...]:
        """Codes of the present doubts, the oldest first."""
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
        return not all(self._is_over(spell, now) for spell in self._spells.values())

    @staticmethod
    def _is_over(spell: _Spell, now: Instant) -> bool:
        return now.mono - spell.newest > LIMITS.doubt_ends_s


Link = Literal["UNKNOWN", "LIVE", "LATE", "LOST"]

_MOST_POSES = 128
_NOWHERE = Pose2D(math.nan, math.nan, math.nan)
_FRAME_FRESH_S = 0.5
"""Greatest age of a detection frame that proves a spot empty (s)."""


@dataclass(frozen=True, slots=True)
class Sensed:
    """The newest observation of one kind, and the time of its measurement.

    Attributes:
        observation: The observation.
        at: Lower bound of that time; None: unknown.
    """

    observation: Observation
    at: Instant | None


@dataclass(slots=True)
class RobotState:
    """The known state of one robot.

    Attributes:
        pose_at: Lower bound of the time at which the newest odometry was measured
            (monotonic, s): proven if the robot echoes, else estimated; None: unknown.
        estimated_since: Arrival of the first odometry that proves no age; None: the
            newest proves it (monotonic, s).
        unproven_since: Arrival of the first odometry of unknown age; None: the newest
            has an age (monotonic, s).
        alive_since: Arrival of odometry after a silence (monotonic, s).
        contact_since: Begin of the present series of odometry and reports without a
            silence, by their times of measurement (monotonic, s).
        contact_until: The newest of these times (monotonic, s).
        detections_at: Like ``pose_at``, for the newest detection frame.
        sighted_at: Like ``pose_at``, for the frame that came last, newest or not; the
            likely time where no bound is known.
        scan_received: Like ``pose_at``, for the newest scan.
        safety_received: Like ``pose_at``, for the newest safety report.
        detector: Evidence that its detection frames are read whole.
        refused: Whether a setting says that the robot is ignored.
        unlabelled: Whether boxes of its newest frame with boxes named no frame.
        live_at: Last message of a live safety node for a robot that the fleet calls a
            recording (monotonic, s): from then on it counts as live.
        refused_at: Last refusal of a message that calls itself a replay, since the
            robot is live (monotonic, s).
        map_frame: Map frame that the messages of a recording name.
        sensed: Newest observation of each kind without an attribute of its own.
        doubts: Contradictions of the robot with itself or physics.
        trusted_pose: Newest pose from before the first open contradiction.
        present_boot: The present boot, as far as echoes prove it.
        track: Poses, twists and reports, and the motion that they show.
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
    contact_since: float = float("-inf")
    contact_until: float = float("-inf")
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
        default_factory=lambda: deque(maxlen=_MOST_POSES)
    )

    def age_s(self, now: Instant) -> float | None:
        """Greatest age of the pose (s); None: no pose yet, or unknown."""
        return None if self.pose_at is None else max(0.0, now.mono - self.pose_at)

    def likely_pose_at(self) -> float | None:
        """``pose_at``; while that is unknown, arrival of the pose (monotonic, s)."""
        if self.pose_at is None and self.odometry_received is not None:
            return self.odometry_received.mono
        return self.pose_at

    def possible_places(self) -> Sequence[tuple[float, float]]:
        """Two places in ``map`` where it may be: now, and before a doubt (m).

        Both are the same where only one is known, and no numbers where none is.
        """
        own = None if self.odometry is None else self.odometry.pose
        poses = [*filter(None, (own, self.trusted_pose))] or [_NOWHERE]
        return [(pose.x, pose.y) for pose in (poses[0], poses[-1])]

    def link(self, now: Instant) -> Link:
        """LIVE, LATE or LOST by the age of the pose (docs/safety.md, "Age")."""
        age = self.age_s(now)
        if age is None:
            since = self.unproven_since
            is_lost = since is not None and now.mono - since > LIMITS.late_s
            return "LOST" if is_lost else "UNKNOWN"
        if age <= LIMITS.live_s:
            return "LIVE"
        return "LATE" if age <= LIMITS.late_s else "LOST"

    def is_believed(self, now: Instant) -> bool:
        """Whether it may count as evidence: LIVE, and nothing is contradicted."""
        return self.link(now) == "LIVE" and not self.doubts.is_open(now)

    @property
    def profile(self) -> RobotProfile:
        """The robot's profile."""
        return self.description.profile

    @property
    def is_replay(self) -> bool:
        """Whether it is a recording: by the fleet, until a live safety node speaks.

        The name of its task does not count, since any robot may choose that.
        """
        return self.description.kind == "recording" and self.live_at is None

    @property
    def recording(self) -> str | None:
        """Map frame of a recording, by default its id; None: the robot is live."""
        return (self.map_frame or self.robot_id) if self.is_replay else None

    @property
    def stands(self) -> bool:
        """Whether its odometry is known, and nothing shows motion."""
        return self.odometry is not None and not self.track.motion.moves

    def motion(self, now: Instant) -> Motion:
        """Motion in the last second before a silence."""
        # After a silence nothing shows that the contradiction goes on.
        motion, received = self.track.motion, self.odometry_received
        if motion.contradiction is None or received is None:
            return motion
        is_old = now.mono - received.mono > LIMITS.silence_s
        return replace(motion, contradiction=None) if is_old else motion

    def pose_at_stamp(self, stamp_s: float | None) -> Pose2D | None:
        """The pose at a moment of the robot's own clock (s), interpolated.

        Before the short history its first pose counts, after it the newest.  The newest
        also counts without a stamp, and for a stamp so old that it is of another clock.
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

    def camera_now(self, now: Instant) -> Pose2D | None:
        """Pose of its camera in ``map``; None: not reliable now."""
        if self.odometry is None or self.detector.blind_by is not None:
            return None
        return self.camera_at(self.odometry.pose, now)

    def camera_at(self, pose: Pose2D, now: Instant) -> Pose2D | None:
        """Pose of its camera, if it is LIVE and its frames are fresh and read whole.

        A robot that contradicts itself, however shortly, proves no place empty.
        """
        if self.detections_at is None or not self.is_believed(now):
            return None
        is_unread = self.detector.is_flawed(now, but="blind")
        is_late = now.mono - self.detections_at > _FRAME_FRESH_S
        if is_unread or is_late or self.detector.out_of_service is not None:
            return None
        return pose.compose(self.profile.camera)

    def note_contact(self, moment: float) -> None:
        """Note odometry or a report that was measured then (monotonic, s)."""
        # After a silence the time to obey begins anew.
        if moment - self.contact_until > LIMITS.silence_s:
            self.contact_since = moment
        # A late message must not shorten the series.
        self.contact_until = max(self.contact_until, moment)

    def contact_for_s(self, since: float) -> float:
        """Time without a silence since a moment (s)."""
        return self.contact_until - max(since, self.contact_since)

    def received_at(self, kind: type[Observation]) -> Instant | None:
        """Time of the newest observation of a kind; None: there is none."""
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
    ) -> Freshness:
        """Freshness of a message in its stream.

        A message of an earlier boot must not make the present boot look old.  Orion may
        have kept such a message, or its echo proves it to be one.

        ``proven_at``: When the feedback that it echoes was composed (monotonic, s);
        None: it proves nothing.
        """
        order = self._orders[kind_of(received.observation)]
        is_earlier = received.is_query_answer
        if proven_at is not None:
            self.present_boot.meet(origin.boot, proven_at)
            is_earlier |= self.present_boot.is_past(origin.boot, proven_at)
        if is_earlier and order.is_of_other_boot(origin):
            return "late"
        return order.judge(origin, received.at.mono, proven_at)

    def order_of(self, kind: type[Observation]) -> StreamOrder:
        """Order of its messages of a kind."""
        return self._orders[kind]

    def is_newest(self, kind: type[Observation], origin: Origin) -> bool:
        """Whether nothing newer than this message is known."""
        order = self.order_of(kind)
        return (order.boot, order.seq) == (origin.boot, origin.seq)

    def forget_poses(self) -> None:
        """Drop all poses of ``pose_at_stamp``."""
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
    """Learn the map frame of a recording, or that the robot is live after all.

    A safety node that speaks now is live, unless it says that it plays a recording.
    """
    if robot.description.kind == "live":
        return
    if origin.replay is not None:
        robot.map_frame = origin.replay
    elif isinstance(received.observation, SafetyReport | CommandAnswer):
        robot.live_at = received.at.mono


def store(robot: RobotState, received: Received, moment: float | None) -> None:
    """Store the newest observation of its kind.

    ``moment``: Lower bound of its time of measurement (monotonic, s); None: unknown.
    """
    observation, at = received.observation, received.at
    match observation:
        case Odometry():
            _store_odometry(robot, observation, received, moment)
        case LaserScan():
            robot.scan, robot.scan_received = observation, dated(at, moment)
            robot.scan_pose = robot.pose_at_stamp(observation.origin.own_s)
        case DetectionFrame():
            _store_frame(robot, observation, received, moment)
        case SafetyReport():
            _store_report(robot, observation, received, moment)
        case Navigation():
            robot.navigation, robot.navigation_received = observation, at
        case CommandStatus():
            robot.command_status = observation.status
        case CommandAnswer() | GoalAnswer():
            pass  # An event, no state: the machine of its command takes it.
        case _:
            robot.sensed[type(observation)] = Sensed(observation, dated(at, moment))


def note_motion(
    robot: RobotState, observation: Observation, at: Instant, moment: float | None
) -> None:
    """Note contact with a robot, and its motion by the newest message."""
    match observation:
        case Odometry(pose=pose, twist=twist, origin=origin):
            likely = at.mono if robot.pose_at is None else robot.pose_at
            robot.track.note_odometry(pose, twist, likely, origin, at.mono)
        case SafetyReport(linear=linear, angular=angular):
            since = robot.safety_received or at
            robot.track.note_report(linear, angular, since.mono)
        case _:
            return
    robot.note_contact(at.mono if moment is None else moment)


def _store_frame(
    robot: RobotState, frame: DetectionFrame, received: Received, moment: float | None
) -> None:
    """Store the newest detection frame."""
    robot.detections_at = _not_before(
        robot.detections_at, robot.frame, frame.origin, moment
    )
    robot.frame, robot.frame_transport = frame, received.transport
    if frame.detections:
        robot.unlabelled = any(box.frame_id is None for box in frame.detections)


def _store_report(
    robot: RobotState, report: SafetyReport, received: Received, moment: float | None
) -> None:
    """Store the newest safety report."""
    known = robot.safety_received
    before = None if known is None else known.mono
    moment = _not_before(before, robot.safety, report.origin, moment)
    robot.safety, robot.safety_received = report, dated(received.at, moment)


def _store_odometry(
    robot: RobotState, odometry: Odometry, received: Received, moment: float | None
) -> None:
    """Store the newest odometry."""
    at = received.at
    origin, pose, before = odometry.origin, odometry.pose, robot.odometry
    moment = _not_before(robot.pose_at, before, origin, moment)
    robot.pose_at = moment
    robot.unproven_since = _since(robot.unproven_since, at, holds=moment is None)
    robot.estimated_since = _since(
        robot.estimated_since, at, holds=not origin.acknowledgements
    )
    # During a contradiction the pose from before it stays trusted.
    if before is not None and not (robot.trusted_pose and robot.doubts.is_open(at)):
        robot.trusted_pose = before.pose
    previous = robot.odometry_received
    if previous is None or at.mono - previous.mono > LIMITS.silence_s:
        robot.alive_since = at.mono
    robot.odometry, robot.odometry_received = odometry, at
    robot.odometry_transport = received.transport
    if before is not None and before.origin.boot != origin.boot:
        robot.forget_poses()  # Another boot counts its seconds anew.
    robot.remember_pose(at.wall if origin.own_s is None else origin.own_s, pose)


def _since(before: float | None, at: Instant, *, holds: bool) -> float | None:
    """Begin of something that holds now (monotonic, s); None: it does not hold."""
    if not holds:
        return None
    return at.mono if before is None else before


def _not_before(
    known: float | None,
    before: Odometry | DetectionFrame | SafetyReport | None,
    origin: Origin,
    moment: float | None,
) -> float | None:
    """Lower bound of the measurement time of the newest message (monotonic, s).

    Within a boot whose messages are counted it was measured after the one before it,
    so the bound of that one, ``known``, holds as well.
    """
    if known is None or before is None:
        return moment
    if origin.seq is None or origin.boot is None or origin.boot != before.origin.boot:
        return moment
    return known if moment is None else max(known, moment)


def dated(at: Instant, moment: float | None) -> Instant | None:
    """A monotonic moment on both clocks; ``at`` is a moment on both."""
    return None if moment is None else at.later(moment - at.mono)


SLOW_SHARE = 0.55
"""Half speed and the error of drive and odometry, as a share of the greatest speed."""
_LEAST_S, _BEYOND_BRAKING_S = 1.5, 0.5
"""Least time to obey, and time beyond that of the braking (s)."""
_FAST_FOR_S = 0.5
"""Time of too high a speed that is no error of measurement (s)."""


def slow_below(profile: RobotProfile) -> float:
    """Speed up to which a robot counts as slow (m/s)."""
    return SLOW_SHARE * profile.max_speed


def allowed_s(profile: RobotProfile) -> float:
    """Time that a robot may take to obey (s)."""
    # Braking from the greatest speed to half of it, as weakly as margins assume.
    halves_s = (1.0 - HALF_SPEED) * profile.max_speed / profile.assumed_braking
    return max(_LEAST_S, halves_s + _BEYOND_BRAKING_S)


class Obedience:
    """Obedience of robots to their limits, measured in their motion.

    It does not depend on decisions: zones come and go while a robot without feedback
    drives on.  Nor does it depend on the robot's report.  A standing robot is obedient.

    Only time with contact counts, by the times of measurement (monotonic, s).  So late
    messages accuse nobody, and a silence begins the time anew.
    """

    def __init__(self) -> None:
        self._limits: dict[str, tuple[float, SpeedLimit]] = {}
        """Robot → begin of its half speed (monotonic, s), and the present limit."""
        self._fast_since: dict[str, float] = {}

    def published(self, limits: Mapping[str, SpeedLimit], now: Instant) -> None:
        """Note the limits in a feedback that was published."""
        for robot_id, limit in limits.items():
            if limit.speed_factor > HALF_SPEED:
                self._limits.pop(robot_id, None)
                continue
            # The time to obey runs on while zones and reasons change.
            since, _ = self._limits.get(robot_id, (now.mono, limit))
            self._limits[robot_id] = since, limit

    def ignored(self, robot: RobotState, now: Instant) -> SpeedLimit | None:
        """The limit that a robot disobeys; None: it obeys, or that is unknown."""
        robot_id = robot.robot_id
        if robot.motion(now).speed <= slow_below(robot.profile):
            self._fast_since.pop(robot_id, None)
            return None
        # By times of measurement: a late message accuses nobody.
        fast_since = self._fast_since.setdefault(robot_id, robot.contact_until)
        since, limit = self._limits.get(robot_id, (now.mono, None))
        is_late = robot.contact_for_s(since) > allowed_s(robot.profile)
        is_fast = robot.contact_for_s(fast_since) >= _FAST_FOR_S
        return limit if is_late and is_fast else None
