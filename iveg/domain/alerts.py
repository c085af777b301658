"""Alerts to people after ISA-18.2: raised, acknowledged, cleared; and their causes.

The conditions that hold are found anew each time; the book compares them with the
alerts that it keeps (docs/dashboard.md, "Alerts").  A condition that ends clears its
alert; one that returns is the same alert, one occurrence more.  One row stands for all
of them, but never for less than the gravest unacknowledged occurrence: grouping cannot
hide an escalation.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf

from iveg.domain.detection_rule import RECOVERED, DetectionRule
from iveg.domain.events import Condition, Priority, Slot
from iveg.domain.feedback import SpeedLimit
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.records import AlertRecord
from iveg.domain.robot_state import RobotState
from iveg.domain.stamps import wall_of
from iveg.domain.tracking.person import Thing
from iveg.domain.words import WordAnswer

GROUPING_S = 600.0
"""A condition that returns within this time is the same alert, counted once more."""
MOST_KEPT = 200
"""Beyond this number even an unacknowledged P1 is left to the history."""


@dataclass(frozen=True, slots=True)
class AlertOccurrence:
    """One period in which a condition held, with its acknowledgement."""

    priority: Priority
    raised: Instant
    cleared: Instant | None = None
    acknowledged: Instant | None = None
    acknowledged_by: str | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class BookedAlert:
    """One alert with its life: every occurrence of one condition.

    Attributes:
        condition: As it is now, or was when it cleared.
        raised: The first occurrence.
        last: The newest occurrence.
        unseen: Gravest priority that nobody has acknowledged; None when all are seen.
        count: All occurrences.
    """

    alert_id: str
    condition: Condition
    raised: Instant
    last: AlertOccurrence
    unseen: Priority | None
    count: int = 1

    @property
    def cleared(self) -> Instant | None:
        """When the condition went; None while it holds."""
        return self.last.cleared

    @property
    def waits(self) -> bool:
        """Whether people should see it: it is active, or an unacknowledged P1."""
        return self.cleared is None or self.unseen == "P1"

    @property
    def priority(self) -> Priority:
        """Shown priority: never less than the gravest unacknowledged one."""
        return graver(self.condition.priority, self.unseen)


def graver(one: Priority, other: Priority | None) -> Priority:
    """The priority that must not be hidden by the other."""
    return one if other is None else min(one, other)


class AlertBook:
    """All active alerts and the recently cleared ones."""

    def __init__(self) -> None:
        self._alerts: dict[tuple[str, str], BookedAlert] = {}

    @property
    def waiting(self) -> list[BookedAlert]:
        """Active alerts, and each P1 that cleared before it was acknowledged."""
        return [one for one in self._alerts.values() if one.waits]

    def sync(
        self, conditions: Iterable[Condition], now: Instant, new_id: str
    ) -> list[BookedAlert]:
        """Take the conditions that hold now; returns the alerts that they changed."""
        wrong: dict[tuple[str, str], Condition] = {}
        for condition in conditions:
            known = wrong.setdefault(_key(condition), condition)
            if condition.priority < known.priority:
                wrong[_key(condition)] = condition
        changed = []
        for key, alert in self._alerts.items():
            if key not in wrong and alert.cleared is None:
                ended = replace(alert.last, cleared=now)
                self._alerts[key] = replace(alert, last=ended)
                changed.append(self._alerts[key])
        for number, (key, condition) in enumerate(wrong.items()):
            before = self._alerts.get(key)
            if before is None or not _goes_on(before, condition):
                alert_id = f"{new_id}-{number}"
                self._alerts[key] = _raise(before, condition, now, alert_id)
                changed.append(self._alerts[key])
            elif condition != before.condition:
                # Else it stays the very same object for whoever draws it.
                self._alerts[key] = replace(before, condition=condition)
        self._forget(now)
        return changed

    def acknowledge(
        self, alert_id: str, by: str, note: str, now: Instant
    ) -> BookedAlert | None:
        """Acknowledge all occurrences; None when there is no such alert."""
        alert = self.find(alert_id)
        if alert is None:
            return None
        last = alert.last
        if last.acknowledged is None:
            last = replace(last, acknowledged=now, acknowledged_by=by, note=note)
        seen = replace(alert, last=last, unseen=None)
        self._alerts[_key(alert.condition)] = seen
        return seen

    def remember(self, alerts: Iterable[BookedAlert]) -> None:
        """Take up cleared, unacknowledged alerts of an earlier run; known ones stay.

        If the condition holds again, a new alert of this run already stands beside it.
        """
        for alert in alerts:
            if _key(alert.condition) in self._alerts:
                named = replace(alert.condition, subject=alert.alert_id)
                alert = replace(alert, condition=named)
            self._alerts[_key(alert.condition)] = alert

    def find(self, alert_id: str) -> BookedAlert | None:
        """An alert that is active or recently cleared."""
        found = (one for one in self._alerts.values() if one.alert_id == alert_id)
        return next(found, None)

    def _forget(self, now: Instant) -> None:
        for key, alert in list(self._alerts.items()):
            cleared = alert.cleared
            is_old = cleared is not None and now.mono - cleared.mono > GROUPING_S
            if is_old and (not alert.waits or len(self._alerts) > MOST_KEPT):
                del self._alerts[key]


def _key(condition: Condition) -> tuple[str, str]:
    return condition.key, condition.subject


def _goes_on(before: BookedAlert, condition: Condition) -> bool:
    """Whether the occurrence continues: a graver one is a new occurrence."""
    return before.cleared is None and condition.priority >= before.condition.priority


def _raise(
    before: BookedAlert | None, condition: Condition, now: Instant, alert_id: str
) -> BookedAlert:
    new = AlertOccurrence(condition.priority, now)
    if before is None:
        return BookedAlert(alert_id, condition, now, new, unseen=new.priority)
    # The same alert, but a new occurrence needs a new acknowledgement.
    return replace(
        before,
        condition=condition,
        last=new,
        unseen=graver(new.priority, before.unseen),
        count=before.count + 1,
    )


ESTIMATED_SHOWN_AFTER_S = 5.0
"""Time that a robot may take to receive its first feedback (s)."""
DETECTOR_STARTS_S = 10.0
"""Time that a fleet may take to send its first detection frames after iVeg's start."""
SHOWN_S = 10.0
"""Time for which a condition is reported after it last held (s): one at its bound is
one alert and not one a second."""


def of_ignored(robot_id: str, limit: SpeedLimit | None) -> Iterable[Condition]:
    """A limit that a robot does not keep to is a P1; a slow-down as such is no alert.

    The slow-down is on the robot's card, on the map and in the log.
    """
    if limit is None:
        return
    is_person = limit.reason == "person" and limit.distance_m is not None
    key = "alert.person_not_slowing" if is_person else "alert.no_slow_down"
    slots: dict[str, Slot] = {"person": limit.cause, "decision": limit.decision_id}
    if limit.distance_m is not None:
        slots["distance"] = round(limit.distance_m, 2)
    yield Condition.of_robot("P1", key, robot_id, **slots)


def of_robot(robot: RobotState, now: Instant) -> Iterable[Condition]:
    """A robot that is lost, doubted, or whose clock or detector is off."""
    name = robot.robot_id
    if robot.link(now) == "LOST":
        moves = robot.motion(now).moves
        key = "alert.moving_robot_lost" if moves else "alert.robot_lost"
        yield Condition.of_robot("P1" if moves else "P2", key, name)
    if robot.refused:
        yield Condition.of_robot("P3", "alert.robot_refused", name)
    offset = robot.clock.warning(now, _may_be_late_s(robot, now))
    if offset is not None:
        shown = round(offset, 2)
        yield Condition.of_robot("P3", "alert.clock_offset", name, offset=shown)
    for code in robot.doubts.active(now)[:1]:
        yield Condition.of_robot("P2", "alert.doubt", name, code=code)


def of_detector(
    robot: RobotState, now: Instant, *, started: Instant
) -> Iterable[Condition]:
    """A detector whose pictures are not read whole; ``started``: when iVeg did."""
    name, detector = robot.robot_id, robot.detector
    if _is_recent(detector.flawed_at.get("overload"), now):
        yield Condition.of_robot("P2", "alert.pictures_not_judged", name)
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
    """Words of detectors that nobody knows, and those that are said to be nobody."""
    for robot in robots:
        for name, heard in robot.detector.words.items():
            for word in heard.unknown:
                yield _of_word("alert.unknown_word", name, word)
    for one in answers:
        if not one.is_person:
            yield _of_word("alert.harmless_word", one.detector, one.word, by=one.by)


def _of_word(key: str, detector: str, word: str, **more: Slot) -> Condition:
    slots: dict[str, Slot] = {"word": word, "detector": detector, **more}
    return Condition("P3", key, f"{detector}/{word}", None, slots)


def of_other_authors(boots: Iterable[str]) -> Iterable[Condition]:
    """Another server that robots hear: they keep to the least that any allows."""
    if names := ", ".join(boots):
        slots: dict[str, Slot] = {"boot": names}
        yield Condition("P1", "alert.another_iveg", "fleet", None, slots)


def of_things(things: Iterable[Thing]) -> Iterable[Condition]:
    """Places where an operator said that nobody is."""
    for one in things:
        slots: dict[str, Slot] = {"x": round(one.x, 2), "y": round(one.y, 2)}
        slots["by"] = one.by
        yield Condition("P3", "alert.thing_marked", one.thing_id, None, slots)


def _is_unplaced(robot: RobotState, now: Instant, started: Instant) -> bool:
    """Whether it still sees somebody without knowing where it is: not while it starts.

    A robot's first pictures may come before its first odometry.
    """
    unplaced_at = robot.detector.flawed_at.get("unplaced")
    is_starting = now.mono - started.mono < DETECTOR_STARTS_S
    return not is_starting and _is_recent(unplaced_at, now, LIMITS.silence_s)


def _is_silent(robot: RobotState, now: Instant, started: Instant) -> bool:
    """Whether people are to look after it: not while it starts, nor of a lost robot."""
    detector = robot.detector
    if detector.is_flawed(now) or not detector.is_missing(now):
        return False
    # One that is stamped by another clock speaks.
    apart_at = robot.clock.detector_apart_at
    if robot.link(now) == "LOST" or _is_recent(apart_at, now, LIMITS.silence_s):
        return False
    if detector.whole_at is not None and robot.pose_at is not None:
        # Else all of it is late or has just come back: the robot itself is reported.
        is_alive = now.mono - (robot.alive_since or now.mono) > LIMITS.silence_s
        return is_alive and robot.pose_at - detector.whole_at > LIMITS.silence_s
    return detector.worked or now.mono - started.mono >= DETECTOR_STARTS_S


def of_kind(robot: RobotState, now: Instant) -> Iterable[Condition]:
    """A robot whose messages contradict its kind in the fleet: live or recording."""
    name = robot.robot_id
    if _is_recent(robot.live_at, now):
        yield Condition.of_robot("P1", "alert.recording_is_live", name)
    if _is_recent(robot.refused_at, now):
        yield Condition.of_robot("P2", "alert.replay_refused", name)


def _is_recent(moment: float | None, now: Instant, within_s: float = SHOWN_S) -> bool:
    return moment is not None and now.mono - moment < within_s


def _may_be_late_s(robot: RobotState, now: Instant) -> float:
    """Greatest delay of the messages of a robot that echoes (s); else 0."""
    if robot.odometry is None or not robot.odometry.origin.acknowledgements:
        return 0.0
    age = robot.age_s(now)
    return inf if age is None else age


def of_rule(rule: DetectionRule) -> Iterable[Condition]:
    """The rule in force was made from a damaged file, and nobody has looked at it."""
    if rule.author == RECOVERED:
        slots = {"version": rule.version}
        yield Condition("P2", "alert.rule_recovered", "fleet", None, slots)


def of_description(robot: RobotState, now: Instant) -> Iterable[Condition]:
    """Facts that a robot or the fleet file leaves out."""
    name, since = robot.robot_id, robot.estimated_since
    if since is not None and now.mono - since > ESTIMATED_SHOWN_AFTER_S:
        yield Condition.of_robot("P3", "alert.age_estimated", name)
    if not robot.description.is_described:
        yield Condition.of_robot("P3", "alert.robots_not_described", name)
    if robot.unlabelled and robot.profile.unlabelled_frame is None:
        yield Condition.of_robot("P3", "alert.frame_not_named", name)


def write_alert(alert: BookedAlert) -> AlertRecord:
    """An alert as a row; moments are Unix seconds."""
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
    """An alert of an earlier run as one that is over, with its life as it was."""
    if record.cleared_at is None:
        record = cleared_behind(record, now.wall)
    seen = record.acknowledged_at
    last = AlertOccurrence(
        record.priority,
        _moment(record.last_raised_at, now),
        _moment(record.cleared_at or now.wall, now),
        None if seen is None else _moment(seen, now),
        record.acknowledged_by,
        record.note or "",
    )
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
        last,
        unseen=record.priority if seen is None else None,
        count=record.count,
    )


def cleared_behind(record: AlertRecord, found: float) -> AlertRecord:
    """An alert that an earlier run left active; what is still wrong is a new one."""
    return replace(record, cleared_at=found)


def _subject(record: AlertRecord) -> str:
    """The robot or person concerned; the person is unknown after a restart."""
    if record.robot_id is None or "person" in record.slots:
        return record.alert_id
    return record.robot_id


def _moment(wall: float, now: Instant) -> Instant:
    """A moment of an earlier run on this run's clock."""
    return Instant(now.mono - (now.wall - wall), wall)
