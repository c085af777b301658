"""Observations change the world, and the world changes speed limits.

``apply`` takes one observation, and ``settle`` judges the fleet once for all that was
taken.  ``tick`` adds the effects of time alone: silence, expiry, overdue links.  The
heartbeat to the fleet is sent from here and nowhere else, so that a loop that hangs
falls silent and the robots slow.
"""

from collections.abc import Iterable, Sequence

from iveg.domain import alerts
from iveg.domain.decisions import Decisions
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.events import Condition, LogEvent
from iveg.domain.feedback import UNSUPERVISED, SpeedLimit
from iveg.domain.kinds import KIND_OF
from iveg.domain.limits import LIMITS
from iveg.domain.low_values import LowValues
from iveg.domain.observations import (
    Climate,
    DetectionFrame,
    Instant,
    Observation,
    Odometry,
    Received,
    SafetyReport,
)
from iveg.domain.records import AlertRecord, DecisionRecord
from iveg.domain.robot_state import Obedience, slow_below
from iveg.domain.rule.clear import ClearCondition
from iveg.domain.rule.foresight import Encounter
from iveg.domain.rule.judge import SpeedLimits
from iveg.domain.rule.zones import LimitChange, ZoneEntry
from iveg.domain.stream_order import Freshness
from iveg.domain.tracking.people import People
from iveg.vital import topics
from iveg.vital.alerting import Alerting
from iveg.vital.core import Core
from iveg.vital.detections import DetectionTracking
from iveg.vital.evidence import cause_of, places_of, record_of, speed_line
from iveg.vital.feedback import FeedbackPublisher
from iveg.vital.staleness import Staleness

HEARTBEAT_S, _EARLY_S = 0.1, 0.02
"""Time between heartbeats; one goes this early rather than a whole tick late (s)."""
_TOPICS = {
    "robot": topics.ROBOT,
    "scan": topics.SCAN,
    "climate": topics.CLIMATE,
}


class Evaluator:
    """Keeps the world and decides for the fleet.

    Attributes:
        rule: The version in force; a new one counts from the next judgement on.
    """

    def __init__(self, core: Core, rule: DetectionRule) -> None:
        self.world, self.people = core.world, core.people
        self.greenhouse = core.greenhouse
        self.rule = rule
        self.decisions = Decisions()
        self.alerts = Alerting(core)
        self.speed_limits: dict[str, SpeedLimit] = dict.fromkeys(
            self.world.robots, UNSUPERVISED
        )
        self._speed_limits = SpeedLimits(core.greenhouse)
        self.tracking = DetectionTracking(core)
        self._staleness = Staleness(core)
        self._feedback_publisher = FeedbackPublisher(core, self.tracking.other)
        self._event_log, self._new_id = core.event_log, core.ports.new_id
        self._tell = core.supervision.tell
        self._applied: dict[str, float] = {}
        self._low = LowValues()
        self._obedience = Obedience()
        self._moved: dict[str, Odometry] = {}
        self._unlogged: dict[str, SafetyReport] = {}
        """Reports of a changed factor; the next judgement may explain it in the log."""
        self._unjudged: Instant | None = None
        self._started: Instant | None = None

    def beginning(self) -> tuple[People, SpeedLimits]:
        """Copies of people and limits, from which a rule trial begins."""
        return self.people.copy(), self._speed_limits.copy()

    @property
    def entries(self) -> Iterable[ZoneEntry]:
        """Every zone entry that has not ended."""
        return self._speed_limits.entries

    def encounters(self, robot_id: str, now: Instant) -> Sequence[Encounter]:
        """Zones that a robot will reach, the soonest first; old forecasts left out."""
        encounters = self._speed_limits.encounters.get(robot_id, {}).values()
        young = (
            forecast
            for forecast in encounters
            if now.mono - forecast.at <= LIMITS.silence_s
        )
        return sorted(young, key=lambda forecast: forecast.in_s)

    def unmet(self, robot_id: str) -> Sequence[ClearCondition]:
        """Clear conditions that a robot does not meet now, its limit's reason first."""
        return self._speed_limits.unmet.get(robot_id, ())

    def decision_record(self, decision_id: str) -> DecisionRecord | None:
        """A decision that is still in memory."""
        decision = self.decisions.get(decision_id)
        return None if decision is None else record_of(decision)

    # --- what arrives -------------------------------------------------------------

    def apply(self, received: Received) -> Freshness:
        """Apply one observation; :meth:`settle` judges what follows from it."""
        freshness = self.world.apply(received)
        observation, at = received.observation, received.at
        if freshness == "new":
            self._note(observation, at)
        if freshness in ("new", "stored"):
            changes = KIND_OF[type(observation)].changes
            if changes is not None:
                self._event_log.changed(_TOPICS[changes].for_id(observation.robot_id))
        if isinstance(observation, DetectionFrame) and freshness != "refused":
            # A late frame may still protect somebody.
            self.tracking.track_frame(observation, received, freshness, self.rule)
        return freshness

    def _note(self, observation: Observation, at: Instant) -> None:
        """Note a new observation: its changes, and whether it calls for a judgement."""
        match observation:
            case Odometry():
                self._drove(observation, at)
            case Climate():
                self._event_log.climate(observation, at)
            case SafetyReport():
                self._reported(observation, at)
            case DetectionFrame():
                self._await_judgement(at)
        row = KIND_OF[type(observation)]
        if row.sensor is not None:
            self._event_log.reading(row, observation, at)

    @property
    def is_unjudged(self) -> bool:
        """Whether :meth:`settle` has yet to judge an observation."""
        return self._unjudged is not None

    def _await_judgement(self, at: Instant) -> None:
        if self._unjudged is None or at.mono >= self._unjudged.mono:
            self._unjudged = at

    def settle(self) -> None:
        """Judge the fleet once for everything that was taken since the last time."""
        if self._unjudged is not None:
            self._settle(self._unjudged)

    def _settle(self, now: Instant) -> None:
        self._unjudged = None
        self._judge(now)
        for robot_id, odometry in self._moved.items():
            robot, speed_limit = self.world.robot(robot_id), self.speed_limits[robot_id]
            self._event_log.odometry(
                odometry, robot, speed_limit.speed_factor, robot.link(now), now
            )
        self._moved.clear()
        for report in self._unlogged.values():
            self._log_speed(report, now)
        self._unlogged.clear()

    def _drove(self, odometry: Odometry, at: Instant) -> None:
        robot = self.world.robot(odometry.robot_id)
        speed, slow = robot.motion(at).speed, slow_below(robot.profile)
        moved = self.decisions.moved(robot.robot_id, speed, at, is_slow=speed <= slow)
        self._event_log.decisions(moved)
        self._await_judgement(at)
        self._moved[odometry.robot_id] = odometry

    def _reported(self, report: SafetyReport, at: Instant) -> None:
        self._event_log.decisions(self.decisions.reported(report, at))
        measured_at = self.world.robot(report.robot_id).safety_received
        if self.tracking.track_obstacle(report, measured_at or at):
            self._await_judgement(at)
        if report.speed_factor != self._applied.get(report.robot_id):
            self._applied[report.robot_id] = report.speed_factor
            self._unlogged[report.robot_id] = report
            self._await_judgement(at)

    # --- judgement ----------------------------------------------------------------

    def _judge(self, now: Instant) -> None:
        speed_limits, changes = self._speed_limits.evaluate(
            self.world, self.people, self.rule, now, self._new_id()
        )
        for change in changes:
            self._note_change(change, now)
        before, self.speed_limits = self.speed_limits, speed_limits
        changed = [
            robot_id
            for robot_id, speed_limit in speed_limits.items()
            if _compared_part(speed_limit) != _compared_part(before[robot_id])
        ]
        for robot_id in changed:
            self._event_log.changed(topics.ROBOT.for_id(robot_id))
        slower = any(
            speed_limits[robot_id].speed_factor < before[robot_id].speed_factor
            for robot_id in changed
        )
        if slower:
            # A slow-down never waits; other news goes with the next heartbeat.
            self.publish(now)
        self._tell("judged", self.rule, speed_limits, changes, now)

    def _note_change(self, change: LimitChange, now: Instant) -> None:
        entry = change.entry
        if not change.began:
            self._event_log.decisions(self.decisions.end(entry.decision_id, now))
            return
        self._event_log.decisions(
            [self.decisions.begin(entry, self.rule, places_of(entry, self.world))]
        )

    def publish(self, now: Instant) -> None:
        """Publish feedback to the fleet (Algorithm 2, line 12)."""
        self._feedback_publisher.publish(self.speed_limits, self.rule, now)
        self._obedience.published(self.speed_limits, now)
        self._event_log.decisions(self.decisions.published(now))

    # --- time ---------------------------------------------------------------------

    def age(self, now: Instant) -> None:
        """Let time pass for the world; ``tick`` judges it then."""
        self._started = self._started or now
        self._staleness.tick(now)
        self._log_returned_detectors(now)
        self.tracking.forget(now)
        self._tell("aged", now)

    def tick(self, now: Instant, more: Iterable[Condition] = ()) -> None:
        """Judge a world that has aged: limits, heartbeat, decisions, alerts."""
        self._settle(now)
        if now.mono - self._feedback_publisher.published_at >= HEARTBEAT_S - _EARLY_S:
            self.publish(now)
        self._event_log.decisions(self.decisions.age(self._received_s))
        self.alerts.sync([*self._conditions(now), *more], now)

    def _log_returned_detectors(self, now: Instant) -> None:
        returned = self.world.returned_detectors
        for robot_id in returned:
            slots = {"robot": robot_id}
            self._event_log.log(
                LogEvent("system", "log.detector_booted", slots, robot_id), now
            )
        returned.clear()

    def _conditions(self, now: Instant) -> Iterable[Condition]:
        for robot in self.world.live_robots():
            ignored = self._obedience.ignored(robot, now)
            yield from alerts.of_ignored_limit(robot.robot_id, ignored)
            yield from alerts.of_robot(robot, now)
            yield from alerts.of_detector(robot, now, started=self._started or now)
            yield from self._low.conditions(robot)
            yield from alerts.of_replay(robot, now)
            yield from alerts.of_description(robot, now)
        yield from alerts.of_other_authors(self.world.other_authors.speaking(now))
        yield from alerts.of_rule(self.rule)
        yield from alerts.of_things(self.people.things.known.values())
        answers = self.world.word_answers.known.values()
        yield from alerts.of_words(self.world.live_robots(), answers)

    def _received_s(self, entry: ZoneEntry) -> float:
        """Time since an entry in which its robot was not silent (s)."""
        return self.world.robot(entry.robot_id).contact_for_s(entry.entered.mono)

    def close_earlier(
        self,
        decisions: Iterable[DecisionRecord],
        alerts: Iterable[AlertRecord],
        now: Instant,
    ) -> None:
        """Close the rows that an earlier run left open; nobody follows them any more.

        Their ids are random, so a row that is not in memory is not of this run.
        """
        self._event_log.left_behind(
            [row for row in decisions if self.decisions.get(row.decision_id) is None],
            [row for row in alerts if not self.alerts.knows(row.alert_id)],
            now,
        )

    def leave(self, now: Instant) -> None:
        """Break off open decisions when iVeg stops, so that their record says so."""
        self._event_log.decisions(self.decisions.break_off(now))

    def leave_unsupervised(self, now: Instant) -> None:
        """Tell every robot to slow, once: a part that supervision needs has ended."""
        limits = dict.fromkeys(self.world.robots, UNSUPERVISED)
        self._feedback_publisher.publish(limits, self.rule, now)

    # --- words --------------------------------------------------------------------

    def _log_speed(self, report: SafetyReport, at: Instant) -> None:
        unmet = self.unmet(report.robot_id)
        self._event_log.write(
            lambda: speed_line(report, cause_of(report, self.decisions), unmet), at
        )


def _compared_part(limit: SpeedLimit) -> tuple[float, str, str | None]:
    """Part of a limit that counts as a change; its distance changes all the time."""
    return limit.speed_factor, limit.reason, limit.cause
