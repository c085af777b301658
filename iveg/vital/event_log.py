"""Event log: lines and changes for browsers at once, rows for the history.

One place turns domain values into log lines and history records, so that the page, the
API and the database agree.
"""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from functools import partial, wraps
from typing import Concatenate, ParamSpec

from iveg.domain.alerts import BookedAlert, cleared_behind, write_alert
from iveg.domain.decisions import SlowdownDecision
from iveg.domain.events import LogEvent
from iveg.domain.geometry import Box3D
from iveg.domain.goals import FollowedGoal
from iveg.domain.kinds import Kind
from iveg.domain.observations import (
    Climate,
    DetectionFrame,
    Instant,
    Observation,
    Odometry,
    Received,
)
from iveg.domain.quantities import value_of
from iveg.domain.records import (
    AlertRecord,
    ClimateRecord,
    CommandEventRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
    OdometryRecord,
    ReadingRecord,
)
from iveg.domain.robot_state import RobotState
from iveg.domain.stop import Changed, FollowedCommand
from iveg.domain.stop.commands import write_command
from iveg.domain.tracking.people import Placed
from iveg.vital import topics
from iveg.vital.evidence import left_behind, record_of
from iveg.vital.record import ODOMETRY_PERIOD_S, RecordSink
from iveg.vital.supervision import Supervision

_KEPT_LINES = 500
# ``asdict`` takes four times as long, and each stored box would pay for it.
_SIDES = tuple(side.name for side in fields(Box3D))
READING_PERIOD_S = 60.0
"""Air and batteries change slowly: a day is 1,440 rows."""
_P = ParamSpec("_P")


def _guarded(
    write: Callable[Concatenate["EventLog", _P], None],
) -> Callable[Concatenate["EventLog", _P], None]:
    """Guard a write: its failure harms the history alone."""

    @wraps(write)
    def guarded(log: "EventLog", /, *args: _P.args, **kwargs: _P.kwargs) -> None:
        log.supervision.guard("history", partial(write, log, *args, **kwargs))

    return guarded


class EventLog:
    """Writes log lines and history records, and tells browsers what changed.

    Attributes:
        lines: The newest log lines, oldest first.
    """

    def __init__(
        self, sink: RecordSink, start: Instant, supervision: Supervision
    ) -> None:
        self.supervision = supervision
        self._sink = sink
        self._recorded: dict[str, tuple[float, float | None, str]] = {}
        """Limit, applied factor and link in the newest pose row of each robot."""
        self._recorded_at: dict[tuple[str, type[Observation]], float] = {}
        """Newest row by robot and kind (monotonic, s); the air's robot is ``""``."""
        # Ids start at the clock (ms): they grow over restarts without a look-up.
        self._next_id = int(start.wall * 1000)
        self.lines: deque[LogRecord] = deque(maxlen=_KEPT_LINES)

    def changed(self, topic: str) -> None:
        """Mark a topic as changed for every browser."""
        self.supervision.tell("changed", topic)

    @_guarded
    def log(self, event: LogEvent, at: Instant) -> None:
        """Write a line of the log."""
        self._next_id += 1
        record = LogRecord(
            id=self._next_id,
            at=at.wall,
            kind=event.kind,
            robot_id=event.robot_id,
            key=event.key,
            slots=dict(event.slots),
            class_=event.class_,
            decision_id=event.decision_id,
        )
        self.lines.append(record)
        self._sink.enqueue(record)
        self.supervision.tell("appended", topics.LOG.name, record)

    @_guarded
    def write(self, event: Callable[[], LogEvent], at: Instant) -> None:
        """Write a line of the log; its facts are looked up under the guard."""
        self.log(event(), at)

    @_guarded
    def decisions(self, changed: Iterable[SlowdownDecision]) -> None:
        """Record decisions that are new or have a new link."""
        for decision in changed:
            self._sink.enqueue(record_of(decision))

    @_guarded
    def left_behind(
        self,
        decisions: Iterable[DecisionRecord],
        alerts: Iterable[AlertRecord],
        now: Instant,
    ) -> None:
        """Close decisions and alerts that an earlier run left open."""
        for decision in decisions:
            self._sink.enqueue(left_behind(decision, now.wall))
        for alert in alerts:
            self._sink.enqueue(cleared_behind(alert, now.wall))

    @_guarded
    def detection(
        self, placed: Placed, frame: DetectionFrame, received: Received
    ) -> None:
        """Record one detection."""
        self._sink.enqueue(detection_of(placed, frame, received))

    @_guarded
    def odometry(
        self, read: Odometry, robot: RobotState, limit: float, link: str, at: Instant
    ) -> None:
        """Record two poses a second, and each change of limit, factor or link."""
        robot_id, report = robot.robot_id, robot.safety
        applied = None if report is None else report.speed_factor
        state, before = (limit, applied, link), self._recorded.get(robot_id)
        is_due = self._is_due(robot_id, Odometry, at, ODOMETRY_PERIOD_S)
        if not is_due and state == before:
            return
        self._recorded[robot_id] = state
        pose, twist = read.pose, read.twist
        self._sink.enqueue(
            OdometryRecord(
                at=at.wall,
                robot_id=robot_id,
                x=pose.x,
                y=pose.y,
                yaw=pose.yaw,
                linear=twist.linear_x,
                angular=twist.angular_z,
                limit_factor=limit,
                applied_factor=applied,
                link=link,
            )
        )

    @_guarded
    def command(
        self, command: FollowedCommand, changed: Changed | None, at: Instant
    ) -> None:
        """Record a command that is new or has changed its state."""
        self._sink.enqueue(write_command(command))
        if changed is not None:
            self._audit(command, changed.state, changed.why or changed.key, at)
        self.supervision.tell(
            "appended", topics.COMMAND.for_id(command.command_id), command
        )

    @_guarded
    def goal(self, goal: FollowedGoal, step: str | None, at: Instant) -> None:
        """Record a new or changed goal; ``step``: why its state changed, if it did."""
        target = goal.goal
        record = CommandRecord(
            command_id=target.goal_id,
            robot_id=goal.robot_id,
            kind="goal",
            state=goal.state,
            requested_by=goal.by,
            requested_at=goal.sent.wall,
            tries=1,
            reason=goal.why,
            goal={
                "kind": target.kind,
                "x": target.x,
                "y": target.y,
                "aisle": goal.aisle,
            },
        )
        self._sink.enqueue(record)
        if step is not None:
            self._audit(record, goal.state, step, at)

    @_guarded
    def left_over(self, row: CommandRecord, heir: str | None, at: Instant) -> None:
        """Close a command of an earlier run.

        Args:
            row: Its newest stored state.
            heir: Id of the STOP that was asserted in its place, if any.
            at: This moment.
        """
        state = "EXPIRED" if heir is None else "REPLACED"
        self._sink.enqueue(replace(row, state=state, reason="restarted"))
        fate = "followed no more" if heir is None else f"asserted again under {heir}"
        self._audit(row, state, f"server restarted; {fate}", at)

    async def flushed(self) -> None:
        """Return when every command and audit row so far is durable.

        A history that fails holds up no STOP: the journal has the desired state.
        """
        try:
            await self._sink.flushed()
        except Exception as error:
            self.supervision.failed("history", error)

    def _audit(
        self,
        command: FollowedCommand | CommandRecord,
        state: str,
        why: str,
        at: Instant,
    ) -> None:
        self._sink.enqueue(
            CommandEventRecord(
                command_id=command.command_id,
                robot_id=command.robot_id,
                at=at.wall,
                state=state,
                why=why,
            )
        )

    @_guarded
    def climate(self, read: Climate, at: Instant) -> None:
        """Record a climate reading, once a minute."""
        if self._is_due("", Climate, at):
            self._sink.enqueue(
                ClimateRecord(
                    at=at.wall,
                    temperature=read.temperature,
                    relative_humidity=read.relative_humidity,
                    co2=read.co2,
                )
            )

    @_guarded
    def reading(self, kind: Kind, read: Observation, at: Instant) -> None:
        """Record a reading of a small sensor, once per period of its kind."""
        period_s = kind.sensor.kept_every_s if kind.sensor else READING_PERIOD_S
        if not self._is_due(read.robot_id, type(read), at, period_s):
            return
        self._sink.enqueue(
            ReadingRecord(
                at=at.wall,
                robot_id=read.robot_id,
                kind=kind.name,
                value=value_of(read),
            )
        )

    def _is_due(
        self,
        robot_id: str,
        kind: type[Observation],
        at: Instant,
        period_s: float = READING_PERIOD_S,
    ) -> bool:
        """Whether a row is due; if so, the next period starts now."""
        last = self._recorded_at.get((robot_id, kind), float("-inf"))
        # Readings at exactly this period arrive early half the time: allow 5 %.
        is_due = at.mono - last >= 0.95 * period_s
        if is_due:
            self._recorded_at[robot_id, kind] = at.mono
        return is_due

    @_guarded
    def alert(self, alert: BookedAlert) -> None:
        """Record an alert that was raised, acknowledged or cleared."""
        self._sink.enqueue(write_alert(alert))
        self.changed(topics.ALERTS.name)


def detection_of(
    placed: Placed, frame: DetectionFrame, received: Received
) -> DetectionRecord:
    """Row of one detection of a frame."""
    x, y, z = placed.position
    return DetectionRecord(
        at=received.at.wall,
        robot_id=frame.robot_id,
        class_id=placed.detection.class_id,
        probability=placed.detection.probability,
        x=x,
        y=y,
        z=z,
        confident=placed.kind != "faint",
        transport=received.transport,
        stamp=frame.origin.stamp,
        class_=placed.class_,
        person_id=None if placed.person is None else placed.person.person_id,
        box={
            **{side: getattr(placed.framed.box, side) for side in _SIDES},
            "frame_id": placed.framed.frame_id,
        },
    )
