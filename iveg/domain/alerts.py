"""Alerts to people after ISA-18.2: raised, acknowledged, cleared; and their conditions.

Each tick finds the conditions that hold, and the book compares them with its alerts
(docs/dashboard.md, "Alerts").  A condition that ends clears its alert.  A condition
that returns soon is a new occurrence of the same alert, in one row.  The row shows at
least the priority of its gravest unacknowledged occurrence, so grouping hides no
escalation.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf

from iveg.domain.detection_rule import RECOVERED, DetectionRule
from iveg.domain.detector import WordAnswer
from iveg.domain.events import Condition, Priority, Slot
from iveg.domain.feedback import SpeedLimit
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.records import AlertRecord
from iveg.domain.robot_state import RobotState
from iveg.domain.stamps import wall_of
from iveg.domain.tracking.things import Thing

GROUPING_S = 600.0
"""Time in which a returning condition is a new occurrence of its old alert (s)."""
MOST_KEPT = 200
"""Number of alerts beyond which an old unacknowledged P1 is left to the history."""


@dataclass(frozen=True, slots=True)
class AlertOccurrence:
    """Period in which a condition held, with its acknowledgement."""

    priority: Priority
    raised: Instant
    cleared: Instant | None = None
    acknowledged: Instant | None = None
    acknowledged_by: str | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class BookedAlert:
    """An alert: all occurrences of one condition.

    Attributes:
        condition: Its condition now, or as it was when it cleared.
        raised: Start of the first occurrence.
        last: The newest occurrence.
        unseen: Gravest unacknowledged priority; None: all are acknowledged.
        count: Number of occurrences.
    """

    alert_id: str
    condition: Condition
    raised: Instant
    last: AlertOccurrence
    unseen: Priority | None
    count: int = 1

    @property
    def cleared(self) -> Instant | None:
        """End of the condition; None while it holds."""
        return self.last.cleared

    @property
    def waits(self) -> bool:
        """Whether people must see it: it is active or an unacknowledged P1."""
        return self.cleared is None or self.unseen == "P1"

    @property
    def priority(self) -> Priority:
        """Shown priority, at least the gravest unacknowledged."""
        return graver(self.condition.priority, self.unseen)


def graver(priority: Priority, other: Priority | None) -> Priority:
    """The graver of two priorities; None is no priority."""
    # "P1" < "P2" < "P3" as texts: the lesser is the graver.
    return priority if other is None else min(priority, other)


class AlertBook:
    """Active and recently cleared alerts, by key and subject of their condition."""

    def __init__(self) -> None:
        self._alerts: dict[tuple[str, str], BookedAlert] = {}

    @property
    def waiting(self) -> list[BookedAlert]:
        """Active alerts, and each P1 that cleared before it was acknowledged."""
        return [alert for alert in self._alerts.values() if alert.waits]

    def sync(
        self, conditions: Iterable[Condition], now: Instant, new_id: str
    ) -> list[BookedAlert]:
        """Take the conditions that hold now; returns the alerts that they changed."""
        present: dict[tuple[str, str], Condition] = {}
        for condition in conditions:
            known = present.setdefault(_key(condition), condition)
            if condition.priority < known.priority:
                present[_key(condition)] = condition
        changed = {
            key: replace(alert, last=replace(alert.last, cleared=now))
            for key, alert in self._alerts.items()
            if key not in present and alert.cleared is None
        }
        for number, (key, condition) in enumerate(present.items()):
            before = self._alerts.get(key)
            # A graver condition is a new occurrence.
            if (
                before is None
                or before.cleared is not None
                or condition.priority < before.condition.priority
            ):
                changed[key] = _raise(before, condition, now, f"{new_id}-{number}")
            elif condition != before.condition:
                # An equal condition keeps its object, so that no page draws it anew.
                self._alerts[key] = replace(before, condition=condition)
        self._alerts.update(changed)
        self._forget(now)
        return [*changed.values()]

    def acknowledge(
        self, alert_id: str, by: str, note: str, now: Instant
    ) -> BookedAlert | None:
        """Acknowledge all occurrences of an alert; None when there is no such alert."""
        alert = self.find(alert_id)
        if alert is None:
            return None
        last = alert.last
        # The first acknowledgement stays on record, if others press again.
        if last.acknowledged is None:
            last = replace(last, acknowledged=now, acknowledged_by=by, note=note)
        acknowledged = replace(alert, last=last, unseen=None)
        self._alerts[_key(alert.condition)] = acknowledged
        return acknowledged

    def remember(self, alerts: Iterable[BookedAlert]) -> None:
        """Add cleared, unacknowledged alerts of an earlier run."""
        for alert in alerts:
            # This run may have raised the condition anew: both alerts must stay.
            if _key(alert.condition) in self._alerts:
                named = replace(alert.condition, subject=alert.alert_id)
                alert = replace(alert, condition=named)
            self._alerts[_key(alert.condition)] = alert

    def find(self, alert_id: str) -> BookedAlert | None:
        """The active or recently cleared alert with this id, if any."""
        known = (alert for alert in self._alerts.values() if alert.alert_id == alert_id)
        return next(known, None)

    def _forget(self, now: Instant) -> None:
        for key, alert in list(self._alerts.items()):
            cleared = alert.cleared
            is_old = cleared is not None and now.mono - cleared.mono > GROUPING_S
            if is_old and (not alert.waits or len(self._alerts) > MOST_KEPT):
                del self._alerts[key]


def _key(condition: Condition) -> tuple[str, str]:
    return condition.key, condition.subject


def _raise(
    before: BookedAlert | None, condition: Condition, now: Instant, alert_id: str
) -> BookedAlert:
    new = AlertOccurrence(condition.priority, now)
    if before is None:
        return BookedAlert(alert_id, condition, now, new, unseen=new.priority)
    # A new occurrence has no acknowledgement, whatever the alert had before.
    return replace(
        before,
        condition=condition,
        last=new,
        unseen=graver(new.priority, before.unseen),
        count=before.count + 1,
    )


ESTIMATED_SHOWN_AFTER_S = 5.0
"""Time that a robot may take to echo its first feedback (s)."""
DETECTOR_STARTS_S = 10.0
"""Time that a fleet may take to send detection frames after iVeg's start (s)."""
SHOWN_S = 10.0
"""Time for which a condition is reported after it last held (s): a value that swings
about its bound makes one alert and not one a second."""


def of_ignored_limit(robot_id: str, limit: SpeedLimit | None) -> Iterable[Condition]:
    """A P1 for a speed limit that a robot does not keep; None: it keeps its limit."""
    if limit is None:
        return
    # The sentence about a person names a distance; without one the general one is true.
    is_person = limit.reason == "person" and limit.distance_m is not None
    key = "alert.person_not_slowing" if is_person else "alert.no_slow_down"
    slots: dict[str, Slot] = {"person": limit.cause, "decision": limit.decision_id}
    if limit.distance_m is not None:
        slots["distance"] = round(limit.distance_m, 2)
    yield Condition.of_robot("P1", key, robot_id, **slots)


def of_robot(robot: RobotState, now: Instant) -> Iterable[Condition]:
    """Conditions of a robot that is lost, refused, in doubt, or whose clock is off."""
    name = robot.robot_id
    if robot.link(now) == "LOST":
        moves = robot.motion(now).moves
        key = "alert.moving_robot_lost" if moves else "alert.robot_lost"
        yield Condition.of_robot("P1" if moves else "P2", key, name)
    if robot.refused:
        yield Condition.of_robot("P3", "alert.robot_refused", name)
    offset = robot.clock.warning(now, _may_be_late_s(robot, now))
    if offset is not None:
        seconds = round(offset, 2)
        yield Condition.of_robot("P3", "alert.clock_offset", name, offset=seconds)
    # All doubts of a robot are one alert, whose sentence names one code.
    for code in robot.doubts.active(now)[:1]:
        yield Condition.of_robot("P2", "alert.doubt", name, code=code)


def of_detector(
    robot: RobotState, now: Instant, *, started: Instant
) -> Iterable[Condition]:
    """Conditions of a detector; ``started``: iVeg's start."""
    name, detector = robot.robot_id, robot.detector
    if _is_recent(detector.flawed_at.get("overload"), now):
        yield Condition.of_robot("P2", "alert.pictures_not_judged", name)
    # Any robot may send too many frames, even a robot described without a detector.
    if not robot.description.has_detector:
        return
    if _is_recent(detector.flawed_at.get("unreadable"), now) or _is_unplaced(
        robot, now, started
    ):
        yield Condition.of_robot("P2", "alert.unreadable_detection", name)
    if _is_recent(robot.clock.detector_accused_at, now):
        yield Condition.of_robot("P2", "alert.detector_clock", name)
    if _is_silent(robot, now, started):
        yield Condition.of_robot("P2", "alert.detector_silent", name)
    if (seer := detector.blind_by) is not None:
        yield Condition.of_robot("P2", "alert.camera_blind", name, by=seer)
    if (out := detector.out_of_service) is not None:
        key = "alert.detector_out_of_service"
        yield Condition.of_robot("P3", key, name, by=out.by, reason=out.reason)


def of_words(
    robots: Iterable[RobotState], answers: Iterable[WordAnswer]
) -> Iterable[Condition]:
    """A P3 for each unknown word of a detector, and each answered as no person."""
    for robot in robots:
        for name, words in robot.detector.words.items():
            for word in words.unknown:
                yield _of_word("alert.unknown_word", name, word)
    for answer in answers:
        if not answer.is_person:
            yield _of_word(
                "alert.harmless_word", answer.detector, answer.word, by=answer.by
            )


def _of_word(key: str, detector: str, word: str, **more: Slot) -> Condition:
    subject = f"{detector}/{word}"
    return Condition.filled("P3", key, subject, word=word, detector=detector, **more)


def of_other_authors(boots: Iterable[str]) -> Iterable[Condition]:
    """A P1 for other servers; a robot that receives several obeys the strictest."""
    if names := ", ".join(boots):
        yield Condition.filled("P1", "alert.another_iveg", "fleet", boot=names)


def of_things(things: Iterable[Thing]) -> Iterable[Condition]:
    """A P3 for each place that an operator marked as "not a person here"."""
    for thing in things:
        x, y = round(thing.x, 2), round(thing.y, 2)
        yield Condition.filled(
            "P3", "alert.thing_marked", thing.thing_id, x=x, y=y, by=thing.by
        )


def _is_unplaced(robot: RobotState, now: Instant, started: Instant) -> bool:
    """Whether somebody in a recent frame has no place for want of the robot's pose."""
    # A robot's first pictures may come before its first odometry.
    unplaced_at = robot.detector.flawed_at.get("unplaced")
    is_starting = now.mono - started.mono < DETECTOR_STARTS_S
    return not is_starting and _is_recent(unplaced_at, now, LIMITS.silence_s)


def _is_silent(robot: RobotState, now: Instant, started: Instant) -> bool:
    """Whether a detector is silent, and neither starts nor belongs to a lost robot."""
    detector = robot.detector
    if detector.is_flawed(now) or not detector.is_missing(now):
        return False
    # A detector with a wrong clock speaks, and has an alert of its own.
    apart_at = robot.clock.detector_apart_at
    if robot.link(now) == "LOST" or _is_recent(apart_at, now, LIMITS.silence_s):
        return False
    if detector.whole_at is not None and robot.pose_at is not None:
        # Where poses are as old as frames the robot is late, not its detector alone.
        is_alive = now.mono - (robot.alive_since or now.mono) > LIMITS.silence_s
        return is_alive and robot.pose_at - detector.whole_at > LIMITS.silence_s
    return detector.worked or now.mono - started.mono >= DETECTOR_STARTS_S


def of_replay(robot: RobotState, now: Instant) -> Iterable[Condition]:
    """Conditions of a robot that contradicts its kind in the fleet: live, recording."""
    name = robot.robot_id
    if _is_recent(robot.live_at, now):
        yield Condition.of_robot("P1", "alert.recording_is_live", name)
    if _is_recent(robot.refused_at, now):
        yield Condition.of_robot("P2", "alert.replay_refused", name)


def _is_recent(moment: float | None, now: Instant, within_s: float = SHOWN_S) -> bool:
    return moment is not None and now.mono - moment < within_s


def _may_be_late_s(robot: RobotState, now: Instant) -> float:
    """Greatest possible delay of messages of a robot that echoes (s); else 0."""
    if robot.odometry is None or not robot.odometry.origin.acknowledgements:
        return 0.0
    age = robot.age_s(now)
    return inf if age is None else age


def of_rule(rule: DetectionRule) -> Iterable[Condition]:
    """A P2 while the rule in force was recovered from a damaged file."""
    if rule.author == RECOVERED:
        yield Condition.filled(
            "P2", "alert.rule_recovered", "fleet", version=rule.version
        )


def of_description(robot: RobotState, now: Instant) -> Iterable[Condition]:
    """A P3 for each fact that a robot or the fleet file leaves out."""
    name, since = robot.robot_id, robot.estimated_since
    if since is not None and now.mono - since > ESTIMATED_SHOWN_AFTER_S:
        yield Condition.of_robot("P3", "alert.age_estimated", name)
    if not robot.description.is_described:
        yield Condition.of_robot("P3", "alert.robots_not_described", name)
    if robot.unlabelled and robot.profile.unlabelled_frame is None:
        yield Condition.of_robot("P3", "alert.frame_not_named", name)


def write_alert(alert: BookedAlert) -> AlertRecord:
    """Row of an alert; its moments are Unix seconds."""
    condition, last = alert.condition, alert.last
    return AlertRecord(
        alert_id=alert.alert_id,
        priority=alert.priority,
        key=condition.key,
        raised_at=alert.raised.wall,
        last_raised_at=last.raised.wall,
        slots=dict(condition.slots),
        robot_id=condition.robot_id,
        cleared_at=wall_of(last.cleared),
        acknowledged_at=wall_of(last.acknowledged),
        acknowledged_by=last.acknowledged_by,
        note=last.note or None,
        count=alert.count,
    )


def read_alert(record: AlertRecord, now: Instant) -> BookedAlert:
    """Cleared alert of an earlier run from its row."""
    if record.cleared_at is None:
        record = cleared_behind(record, now.wall)
    seen = record.acknowledged_at
    return BookedAlert(
        record.alert_id,
        Condition(
            record.priority,
            record.key,
            _subject(record),
            record.robot_id,
            record.slots,
        ),
        _moment(record.raised_at, now),
        AlertOccurrence(
            record.priority,
            _moment(record.last_raised_at, now),
            _moment(record.cleared_at or now.wall, now),
            None if seen is None else _moment(seen, now),
            record.acknowledged_by,
            record.note or "",
        ),
        unseen=record.priority if seen is None else None,
        count=record.count,
    )


def cleared_behind(record: AlertRecord, cleared_at: float) -> AlertRecord:
    """Clear an alert that an earlier run left active (Unix s).

    A condition that still holds raises a new alert.
    """
    return replace(record, cleared_at=cleared_at)


def _subject(record: AlertRecord) -> str:
    """Subject of an earlier alert."""
    # Tracks end with their run: no alert about a new track may continue this one.
    if record.robot_id is None or "person" in record.slots:
        return record.alert_id
    return record.robot_id


def _moment(wall: float, now: Instant) -> Instant:
    """A moment of an earlier run (Unix s), on the monotonic clock of this run, too."""
    return Instant(now.mono - (now.wall - wall), wall)
