"""One robot as iVeg knows it, with the age of everything about it.

Nothing here reads a clock: ages come from the ``now`` that is handed in.
"""

from bisect import bisect_left
from collections import defaultdict, deque
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.clocks import RobotClock
from iveg.domain.detector import DetectorEvidence
from iveg.domain.doubt import Doubts
from iveg.domain.fleet import RobotDescription, RobotProfile
from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    DetectionFrame,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    Received,
    SafetyReport,
    UnreadScan,
    kind_of,
)
from iveg.domain.revocation import Revocation
from iveg.domain.stream_order import OrderVerdict, PresentBoot, StreamOrder
from iveg.domain.transports import FIWARE, TransportId

Link = Literal["UNKNOWN", "LIVE", "LATE", "LOST"]

_HISTORY = 128
GAIN_OVER_S = 1.0


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
        freed_at: When a report last said that it keeps to half speed no longer, by its
            arrival (monotonic, s).
        detector: Whether its pictures are read whole.
        revoked: Whose word it was that it is heard no more.
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
    """

    robot_id: str
    description: RobotDescription
    odometry: Odometry | None = None
    odometry_received: Instant | None = None
    pose_at: float | None = None
    estimated_since: float | None = None
    unproven_since: float | None = None
    alive_since: float | None = None
    scan: LaserScan | UnreadScan | None = None
    scan_pose: Pose2D | None = None
    scan_received: Instant | None = None
    frame: DetectionFrame | None = None
    frame_transport: TransportId = FIWARE.id
    detections_at: float | None = None
    sighted_at: Instant | None = None
    detector: DetectorEvidence = field(default_factory=DetectorEvidence)
    revoked: Revocation | None = None
    unlabelled: bool = False
    safety: SafetyReport | None = None
    safety_received: Instant | None = None
    navigation: Navigation | None = None
    navigation_received: Instant | None = None
    freed_at: float = float("-inf")
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
    _orders: defaultdict[type[Observation], StreamOrder] = field(
        default_factory=lambda: defaultdict(StreamOrder)
    )
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

        Outside the short history the nearest end counts; without a stamp the newest,
        and for one that is so old that it is of another clock.
        """
        poses = self._poses
        if not poses:
            return None
        newest_s = poses[-1][0]
        if stamp_s is None or not newest_s - LIMITS.ring_lasts_s <= stamp_s < newest_s:
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
        """How long it has been heard without a silence since a moment (s)."""
        return self.heard_until - max(since, self.heard_since)

    def fastest_lately(self) -> float:
        """Greatest speed of its last second (m/s)."""
        return max((speed for _, speed in self._speeds), default=0.0)

    def speed_gained(self) -> float:
        """Gain of speed over the mean of its last second (m/s)."""
        if self.odometry is None or not self._speeds:
            return 0.0
        mean = sum(speed for _, speed in self._speeds) / len(self._speeds)
        return abs(self.odometry.twist.linear_x) - mean

    def remember_speed(self, at: float, speed: float) -> None:
        """Keep a speed (m/s) for a second; ``at`` monotonic (s)."""
        self._speeds.append((at, abs(speed)))
        while at - self._speeds[0][0] > GAIN_OVER_S:
            self._speeds.popleft()

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

    def is_past(self, kind: type[Observation], boot: str, seq: int) -> bool:
        """Whether a message of this identity cannot be new."""
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
