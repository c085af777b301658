"""What robots kept during a gap, on its way into the history and nowhere else.

Nothing here reaches the world, the rule or a STOP.  What the rule would have decided of
it is a record of its own kind, made afterwards (``late_decision.py``).  A message
becomes a row only where iVeg itself heard nothing of the robot, so that nobody can
write over what was live.  Its moment is the batch's arrival less its age on the robot's
monotonic clock: a wall clock that is wrong dates nothing.
"""

from collections import Counter, OrderedDict, defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields

from iveg.domain.backfill import OLDEST_S, PERIOD_S, Batch, Silences
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import UNSUPERVISED
from iveg.domain.fleet import RobotDescription
from iveg.domain.frames import FramedBox, resolve_box
from iveg.domain.geometry import Box3D, Pose2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    Instant,
    Observation,
    Odometry,
    SafetyReport,
)
from iveg.domain.records import DetectionRecord, OdometryRecord
from iveg.domain.transports import DIRECT
from iveg.pipeline.late_decision import LateDecisions
from iveg.pipeline.record import RecordSink

PART = "backfill"
_MOST_BOOTS = 4
_BATCHES_PER_S, _MOST_AT_ONCE = 2.0, 10.0
_BACK_S = 1.0
"""So much may the moments of two batches differ by their ways."""
_SIDES = tuple(one.name for one in fields(Box3D))
_POSE_LASTS_S = 1.0


@dataclass(slots=True)
class _Robot:
    """What one robot has sent of its gaps.

    Attributes:
        newest: ``seq`` of its newest kept message by boot.
        until: Moment of the newest kept message (monotonic, s).
        due: When its next row of poses may come, and of pictures.
        pose: Newest kept pose, and when that was; ``applied`` its factor.
        room: Batches that it may still send at once, as of ``room_at``.
    """

    newest: OrderedDict[str, int] = field(default_factory=OrderedDict)
    until: float = float("-inf")
    due: dict[type[Observation], float] = field(default_factory=dict)
    pose: tuple[Pose2D, float] | None = None
    applied: float | None = None
    decisions: LateDecisions = field(default_factory=LateDecisions)
    room: float = _MOST_AT_ONCE
    room_at: float = float("-inf")

    def has_room(self, now: float) -> bool:
        """Whether another batch may come; it is then counted."""
        passed = max(0.0, now - self.room_at)
        self.room = min(_MOST_AT_ONCE, self.room + passed * _BATCHES_PER_S)
        self.room_at = now
        if self.room < 1.0:
            return False
        self.room -= 1.0
        return True

    def is_new(self, boot: str, seq: int, at: float) -> bool:
        """Whether a kept message is behind all others of its boot; it then counts."""
        if seq <= self.newest.get(boot, -1) or at < self.until - _BACK_S:
            return False
        self.newest[boot] = seq
        self.newest.move_to_end(boot)
        if len(self.newest) > _MOST_BOOTS:
            self.newest.popitem(last=False)
        self.until = max(self.until, at)
        return True

    def is_due(self, kind: type[Observation], at: float) -> bool:
        """Whether a row of a kind may come: as many as of live ones."""
        if at < self.due.get(kind, float("-inf")):
            return False
        # Half a tick early must not wait a whole tick more.
        self.due[kind] = at + 0.5 * PERIOD_S
        return True


class Backfill:
    """Writes what robots kept into the history.

    Args:
        fleet: The robots, by id.
        rule: Tells the rule in force: which words name a person or a robot.
        sink: The history.
        silences: When iVeg heard nothing of a robot.
        reject: Counts what cannot be used: source, reason, detail.
        is_revoked: Whether a robot is heard no more.
    """

    def __init__(
        self,
        fleet: Mapping[str, RobotDescription],
        rule: Callable[[], DetectionRule],
        sink: RecordSink,
        silences: Silences,
        reject: Callable[[str, str, str], None],
        is_revoked: Callable[[str], bool] = lambda _: False,
    ) -> None:
        self._is_revoked = is_revoked
        self.counters: Counter[str] = Counter()
        self._fleet, self._rule = fleet, rule
        self._sink, self._silences, self._reject = sink, silences, reject
        self._robots: defaultdict[str, _Robot] = defaultdict(_Robot)

    def has_room(self, robot_id: str, now: Instant) -> bool:
        """Whether a robot may send another batch now; else it is counted as a flood."""
        if self._is_revoked(robot_id):
            self._reject(robot_id, "revoked", "is heard no more")
            return False
        if self._robots[robot_id].has_room(now.mono):
            return True
        self._reject(robot_id, "late_flood", "")
        return False

    def record(self, batch: Batch, arrived: Instant) -> None:
        """Write a batch into the history."""
        sent = batch.origin.mono or 0.0
        for one in batch.kept:
            age_s = sent - (one.origin.mono or 0.0)
            if not 0.0 <= age_s <= OLDEST_S:
                reason = "late_too_old" if age_s > 0.0 else "late_from_the_future"
                self._reject(batch.robot_id, reason, f"{age_s:.1f} s old")
                continue
            self._record_one(one, arrived.later(-age_s))

    def _record_one(self, one: Observation, at: Instant) -> None:
        robot, origin = self._robots[one.robot_id], one.origin
        if not self._silences.covers(one.robot_id, at.mono):
            self.counters["backfill.heard_live"] += 1
            return
        if not robot.is_new(origin.boot or "", origin.seq or 0, at.mono):
            self.counters["backfill.duplicate"] += 1
            return
        self.counters["backfill.taken"] += 1
        match one:
            case SafetyReport():
                robot.applied = one.speed_factor
            case Odometry():
                robot.pose = one.pose, at.mono
                if robot.is_due(Odometry, at.mono):
                    self._sink.enqueue(_pose_row(one, robot.applied, at))
            case DetectionFrame() if robot.is_due(DetectionFrame, at.mono):
                self._record_frame(one, robot, at)

    def _record_frame(self, frame: DetectionFrame, robot: _Robot, at: Instant) -> None:
        rule, description = self._rule(), self._fleet[frame.robot_id]
        pose = None
        if robot.pose is not None and abs(at.mono - robot.pose[1]) <= _POSE_LASTS_S:
            pose = robot.pose[0]
        seen: list[DetectionRecord] = []
        for one in frame.detections:
            if rule.class_of(one.class_id) is not None:
                framed = next(filter(None, resolve_box(one, description)), None)
                place = _place(framed, pose)
                seen.append(_detection_row(one, frame, framed, place, rule, at))
        decided = robot.decisions.judge(seen, pose, robot.applied, rule, frame.origin)
        for row in seen:
            self._sink.enqueue(row)
        for decision in decided:
            self._sink.enqueue(decision)


def _pose_row(one: Odometry, applied: float | None, at: Instant) -> OdometryRecord:
    return OdometryRecord(
        at=at.wall,
        robot_id=one.robot_id,
        x=one.pose.x,
        y=one.pose.y,
        yaw=one.pose.yaw,
        linear=one.twist.linear_x,
        angular=one.twist.angular_z,
        limit_factor=UNSUPERVISED.speed_factor,
        applied_factor=applied,
        link="LOST",
        late=True,
    )


def _place(
    framed: FramedBox | None, pose: Pose2D | None
) -> tuple[float | None, float | None, float | None]:
    """Where a box was in ``map`` (m); nowhere where that is not known."""
    if framed is None:
        return None, None, None
    x, y, z = framed.box.centre
    if framed.frame_id == "map":
        return x, y, z
    if pose is None:
        return None, None, None
    return *pose.transform(x, y), z


def _detection_row(
    one: Detection,
    frame: DetectionFrame,
    framed: FramedBox | None,
    place: tuple[float | None, float | None, float | None],
    rule: DetectionRule,
    at: Instant,
) -> DetectionRecord:
    class_ = rule.class_of(one.class_id)
    x, y, z = place
    box = None
    if framed is not None:
        sides = {side: getattr(framed.box, side) for side in _SIDES}
        box = {**sides, "frame_id": framed.frame_id}
    return DetectionRecord(
        at=at.wall,
        robot_id=frame.robot_id,
        class_id=one.class_id,
        probability=one.probability,
        x=x,
        y=y,
        z=z,
        confident=one.probability >= rule.threshold_of(class_),
        transport=DIRECT.id,
        stamp=frame.origin.stamp,
        class_=class_,
        box=box,
        late=True,
    )
