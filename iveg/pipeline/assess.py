"""The rule at work: every observation into the world, every change into words.

``take`` applies one observation and judges the fleet; ``tick`` does what only time
brings: silence, expiry, overdue links.  The heartbeat to the fleet is sent from here
and nowhere else, so that a loop that hangs falls silent and slows the robots.
"""

from collections.abc import Callable, Iterable, Mapping

from iveg.domain import conditions
from iveg.domain.alarms import Alarm, AlarmBook, Condition
from iveg.domain.alerts import Rule
from iveg.domain.decisions import Decision, Decisions
from iveg.domain.events import LogEvent, Slot
from iveg.domain.feedback import CLEAR, Feedback, FeedbackAlert, Mandate
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.mandates import Change, Crossing, Mandates
from iveg.domain.observations import (
    DetectionFrame,
    Instant,
    LaserScan,
    Odometry,
    Origin,
    Received,
    SafetyReport,
)
from iveg.domain.order import Verdict
from iveg.domain.people import RING_S, People, Person, Placed
from iveg.domain.sight import AllClear
from iveg.domain.world import Link, RobotState, World
from iveg.pipeline.minutes import Minutes
from iveg.pipeline.ports import Fleet, Ids
from iveg.pipeline.publish import Hub
from iveg.pipeline.wording import alarm_line, evidence_of, speed_line

HEARTBEAT_S = 0.1
_LOOK_LOGGED_S = 2.0


class Assessor:
    """Keeps the world and decides for the fleet.

    Args:
        stamp: Writes a wall-clock moment the way the wire does.
        boot: Random, new at each start: identity of our feedback.
    """

    def __init__(
        self,
        world: World,
        greenhouse: Greenhouse,
        rule: Rule,
        fleet: Fleet,
        minutes: Minutes,
        hub: Hub,
        new_id: Ids,
        stamp: Callable[[float], str],
        boot: str,
    ) -> None:
        self.world = world
        self.greenhouse = greenhouse
        self.rule = rule
        self.people = People()
        self.decisions = Decisions()
        self.alarms = AlarmBook()
        self.mandates: dict[str, Mandate] = dict.fromkeys(world.robots, CLEAR)
        self.placed: dict[str, list[Placed]] = {}
        self.protected_unseen = 0
        """How often a robot slowed for somebody whom it could not see itself."""
        self._mandates = Mandates(greenhouse)
        self._all_clear = AllClear()
        self._fleet = fleet
        self._minutes = minutes
        self._hub = hub
        self._new_id = new_id
        self._stamp = stamp
        self._boot = boot
        self._seq = 0
        self._told_at = float("-inf")
        self._links: dict[str, Link] = {}
        self._applied: dict[str, tuple[float, str]] = {}
        self._stages: dict[str, str] = {}
        self._looks: dict[tuple[str, str], float] = {}
        self._other: dict[str, FeedbackAlert] = {}

    @property
    def crossings(self) -> Iterable[Crossing]:
        """Who is inside whose ring now."""
        return self._mandates.crossings

    # --- one observation ----------------------------------------------------------

    def take(self, received: Received) -> bool:
        """Apply one observation; returns whether it became part of the state."""
        verdict = self.world.apply(received)
        observation = received.observation
        if isinstance(observation, DetectionFrame):
            self._look_if_it_counts(observation, received, verdict)
        if verdict != "new":
            return False
        match observation:
            case Odometry():
                self._moved(observation, received.at)
            case LaserScan():
                self._hub.changed(f"robots/{observation.robot_id}/scan")
            case SafetyReport():
                self._reported(observation, received.at)
            case DetectionFrame():
                self._judge(received.at)
        return True

    def _moved(self, odometry: Odometry, at: Instant) -> None:
        for decision in self.decisions.open_of(odometry.robot_id):
            self._advance(decision, decision.moved(odometry.twist.linear_x, at), at)
        self._judge(at)
        robot = self.world.robot(odometry.robot_id)
        mandate = self.mandates[robot.robot_id]
        self._minutes.odometry(robot, mandate.speed_factor, robot.link(at), at)
        self._hub.changed(f"robots/{robot.robot_id}")

    def _reported(self, report: SafetyReport, at: Instant) -> None:
        for decision in self.decisions.open_of(report.robot_id):
            self._advance(decision, decision.reported(report, at), at)
        applied = report.speed_factor, report.reason
        before = self._applied.get(report.robot_id)
        if applied != before:
            self._applied[report.robot_id] = applied
            if before is None or before[0] != applied[0]:
                self._log_speed(report, at)
        self._hub.changed(f"robots/{report.robot_id}")

    def _advance(self, before: Decision, after: Decision, at: Instant) -> None:
        if after is not before:
            self.decisions.put(after)
            self._minutes.decision(after, at)

    # --- looks --------------------------------------------------------------------

    def _look_if_it_counts(
        self, frame: DetectionFrame, received: Received, verdict: Verdict
    ) -> None:
        """A late look still saw somebody; a late answer of Orion's is yesterday's."""
        if verdict == "new" or (verdict == "late" and not received.asked):
            placed = self._look(frame, received)
            if verdict == "new":
                self.placed[frame.robot_id] = placed
                self._hub.changed(f"detections/{frame.robot_id}")

    def _look(self, frame: DetectionFrame, received: Received) -> list[Placed]:
        delay = 0.0
        robot = self.world.robot(frame.robot_id)
        if robot.detections_at is not None:
            delay = max(0.0, received.at.mono - robot.detections_at)
        seen_at = received.at.later(-delay)
        placed = self.people.sight(
            frame, self.world, self.rule, seen_at, self._new_id()
        )
        for one in placed:
            self._describe(one, frame, received)
        if any(one.person is not None for one in placed):
            self._hub.changed("people")
        return placed

    def _describe(self, one: Placed, frame: DetectionFrame, received: Received) -> None:
        """Log a sighting at its start and write it down once in two seconds."""
        at, robot_id = received.at, frame.robot_id
        subject = one.peer or (one.person.person_id if one.person else "")
        subject = subject or f"{one.kind}:{one.detection.class_id}"
        last = self._looks.get((robot_id, subject))
        self._looks[robot_id, subject] = at.mono
        if one.kind == "other":
            self._other[robot_id] = FeedbackAlert("", self._stamp(at.wall))
        if last is not None and at.mono - last < _LOOK_LOGGED_S:
            # Keep the first moment, so that a long sighting gets a row every so often.
            self._looks[robot_id, subject] = last
            return
        self._minutes.detection(one, robot_id, frame.origin.stamp, at, received.road)
        key = {
            "alert": "log.detection",
            "faint": "log.detection_faint",
            "other": "log.detection_unmapped",
        }[one.kind]
        if last is not None and at.mono - last < 2 * _LOOK_LOGGED_S:
            return
        x, y, _ = one.position
        slots: dict[str, Slot] = {
            "robot": robot_id,
            "class": one.class_ or one.detection.class_id,
            "class_id": one.detection.class_id,
            "confidence": one.detection.probability,
            "x": round(x, 2),
            "y": round(y, 2),
            "person": subject,
        }
        self._minutes.log(LogEvent("detection", key, slots, robot_id, one.class_), at)
        if one.appeared and one.person is not None:
            self._stages[one.person.person_id] = "seen"

    # --- judgement ----------------------------------------------------------------

    def _judge(self, now: Instant) -> None:
        mandates, changes = self._mandates.evaluate(
            self.world, self.people, self.rule, now, self._new_id()
        )
        for change in changes:
            self._crossed(change, now)
        before, self.mandates = self.mandates, mandates
        changed = [
            robot_id
            for robot_id, mandate in mandates.items()
            if mandate.speed_factor != before[robot_id].speed_factor
            or mandate.reason != before[robot_id].reason
        ]
        for robot_id in changed:
            self._hub.changed(f"robots/{robot_id}")
            if self.world.robots[robot_id].safety is None:
                self._log_mandate(robot_id, before[robot_id], mandates[robot_id], now)
        if changed or changes:
            self.tell(now)

    def _crossed(self, change: Change, now: Instant) -> None:
        crossing = change.crossing
        if change.began:
            if not crossing.in_sight and crossing.hazard.observer != crossing.robot_id:
                self.protected_unseen += 1
            decision = Decision(crossing, self.rule)
            self.decisions.put(decision)
            self._minutes.decision(decision, now)
            return
        ended = self.decisions.get(crossing.decision_id)
        if ended is not None:
            self._advance(ended, ended.closed(now), now)

    def tell(self, now: Instant) -> None:
        """Send every robot what the fleet must know (Algorithm 2, line 13)."""
        self._told_at = now.mono
        alerts = tuple(self._alerts(now))
        seen = {
            robot.robot_id: robot.safety.origin.seq
            for robot in self.world.robots.values()
            if robot.safety is not None and robot.safety.origin.seq is not None
        }
        for robot in self.world.robots.values():
            self._seq += 1
            self._fleet.tell(self._feedback(robot, alerts, seen, now))
        for decision in self.decisions.every_open():
            self._advance(decision, decision.published(now), now)

    def _feedback(
        self,
        robot: RobotState,
        alerts: tuple[FeedbackAlert, ...],
        seen: Mapping[str, int],
        now: Instant,
    ) -> Feedback:
        mine = [one for one in alerts if one.observer == robot.robot_id]
        newest = max(mine, key=lambda one: one.stamp, default=None)
        odometry = None if robot.is_replay else robot.odometry
        return Feedback(
            robot.robot_id,
            Origin(self._boot, self._seq, self._stamp(now.wall)),
            newest or self._other.get(robot.robot_id),
            alerts,
            None if odometry is None else odometry.pose,
            None if odometry is None else odometry.twist,
            None if odometry is None else odometry.origin.stamp,
            self.mandates,
            seen,
        )

    def _alerts(self, now: Instant) -> Iterable[FeedbackAlert]:
        for person in self.people.known.values():
            for sighting, radius in person.rings(self.rule, now):
                # What a recording saw long ago must not slow a robot of today.
                if self.world.robots[sighting.observer].is_replay:
                    continue
                yield FeedbackAlert(
                    person.decision_id,
                    self._stamp(sighting.at.wall),
                    person.class_,
                    sighting.class_id,
                    sighting.confidence,
                    (sighting.x, sighting.y, sighting.z),
                    radius,
                    sighting.observer,
                )

    # --- time ---------------------------------------------------------------------

    def tick(self, now: Instant, more: Iterable[Condition] = ()) -> None:
        """Let time pass: silence, ages, overdue links, alarms, heartbeat."""
        for robot in self.world.robots.values():
            self._watch_link(robot, now)
        self._age_people(now)
        self._judge(now)
        if now.mono - self._told_at >= HEARTBEAT_S - 1e-3:
            self.tell(now)
        wrong = [*self._conditions(now), *more]
        for alarm in self.alarms.sync(wrong, now, self._new_id()):
            self._minutes.alarm(alarm)
            self._log_alarm(alarm, now)

    def acknowledge(
        self, alert_id: str, by: str, note: str, now: Instant
    ) -> Alarm | None:
        """Somebody has seen an alarm; None when there is no such one."""
        alarm = self.alarms.acknowledge(alert_id, by, note, now)
        if alarm is not None:
            self._minutes.alarm(alarm)
            slots: dict[str, Slot] = {
                **alarm.condition.slots,
                "alert": alarm.condition.key,
                "by": by,
            }
            self._minutes.log(LogEvent("alert", "log.alert.acknowledged", slots), now)
        return alarm

    def _watch_link(self, robot: RobotState, now: Instant) -> None:
        link = robot.link(now)
        before = self._links.get(robot.robot_id, "UNKNOWN")
        if link == before:
            return
        self._links[robot.robot_id] = link
        self._hub.changed(f"robots/{robot.robot_id}")
        slots: dict[str, Slot] = {
            "robot": robot.robot_id,
            "age": round(robot.age_s(now) or 0.0, 1),
        }
        self._minutes.log(
            LogEvent("link", f"log.link.{link.lower()}", slots, robot.robot_id), now
        )

    def _age_people(self, now: Instant) -> None:
        for person in self.people.known.values():
            self._log_stage(person, now)
        for person in self._all_clear.sweep(
            self.people, self.world, self.greenhouse, now
        ):
            self._log_clear(person, now)
        for person in self.people.forget(now):
            self._stages.pop(person.person_id, None)
            self._hub.changed("people")
        if len(self._looks) > _MAX_LOOKS:
            self._looks = {
                key: at for key, at in self._looks.items() if now.mono - at < RING_S
            }

    def _log_stage(self, person: Person, now: Instant) -> None:
        stage = person.stage(now)
        before = self._stages.get(person.person_id)
        if stage == before:
            return
        self._stages[person.person_id] = stage
        self._hub.changed("people")
        key = _STAGE_KEYS.get(stage)
        if key is None or before is None:
            return
        newest = person.newest
        slots: dict[str, Slot] = {
            "person": person.person_id,
            "observer": newest.observer,
            "class": person.class_,
            "lane": self.greenhouse.lane_at(newest.x, newest.y) or "",
        }
        self._minutes.log(
            LogEvent("detection", key, slots, newest.observer, person.class_), now
        )

    def _log_clear(self, person: Person, now: Instant) -> None:
        self._hub.changed("people")
        newest = person.newest
        if person.sightings or person.stage(now) != "remembered":
            return
        slots: dict[str, Slot] = {
            "person": person.person_id,
            "lane": self.greenhouse.lane_at(newest.x, newest.y) or "",
        }
        self._minutes.log(
            LogEvent("detection", "log.person_cleared", slots, None, person.class_),
            now,
        )

    def _conditions(self, now: Instant) -> Iterable[Condition]:
        for decision in self.decisions.every_open():
            yield from conditions.of_decision(decision, now)
        for robot in self.world.live_robots():
            yield from conditions.of_robot(robot, now)

    # --- words --------------------------------------------------------------------

    def _log_speed(self, report: SafetyReport, at: Instant) -> None:
        evidence = evidence_of(
            report, self.decisions, self.people, self.world, self.greenhouse
        )
        self._minutes.log(speed_line(report, evidence), at)

    def _log_mandate(
        self, robot_id: str, before: Mandate, after: Mandate, at: Instant
    ) -> None:
        """For a robot that reports nothing: what it was told, at least."""
        if before.speed_factor == after.speed_factor:
            return
        report = SafetyReport(
            robot_id,
            Origin(),
            after.speed_factor,
            after.reason,
            after.cause,
            after.decision_id,
        )
        self._log_speed(report, at)

    def _log_alarm(self, alarm: Alarm, at: Instant) -> None:
        line = alarm_line(alarm)
        if line is not None:
            self._minutes.log(line, at)


_MAX_LOOKS = 1000
_STAGE_KEYS = {
    "seen": "log.person_seen",
    "remembered": "log.person_remembered",
    "last_seen": "log.person_expired",
}
