"""What is known of each robot, gathered for its situation (``domain/situation``)."""

from collections.abc import Iterable
from dataclasses import replace

from iveg.domain.events import Condition
from iveg.domain.feedback import SpeedLimit
from iveg.domain.limits import LIMITS
from iveg.domain.margins import SafetyMargin
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.robot_state import RobotState
from iveg.domain.situation.facts import Near, RobotFacts, Situation
from iveg.domain.situation.judge import gravest, situation_of
from iveg.domain.situation.slowness import HAZARDS
from iveg.domain.stop.machine import StopMachine
from iveg.domain.tracking.person import TrackedPerson
from iveg.pipeline.evaluate import Evaluator


class Situations:
    """Reads the pipeline's state; keeps nothing.

    Args:
        evaluator: Whose world, people and alerts.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator

    def of(
        self,
        robot: RobotState,
        machine: StopMachine,
        margin: SafetyMargin | None,
        now: Instant,
    ) -> Situation:
        """How it stands with one robot; ``margin`` is its least."""
        limit = self._evaluator.speed_limits[robot.robot_id]
        report, alert = fresh_report(robot, now), gravest(self._alerts(robot.robot_id))
        once = machine.once
        facts = RobotFacts(
            robot_id=robot.robot_id,
            link=robot.link(now),
            age_s=robot.age_s(now),
            stands=robot.stands,
            report=report,
            limit=limit,
            missing=self._evaluator.missing(robot.robot_id),
            doubts=robot.doubts.active(now),
            alert=alert,
            alert_about=None if alert is None else self._whom(robot, alert, now),
            near=None if report is None else self._reported(robot, report, limit, now),
            told_near=self._limited(robot, limit, now),
            margin=margin,
            margin_near=self._person(
                robot, None if margin is None else margin.person_id, now
            ),
            stop=machine.state,
            is_resuming=once is not None and once.kind == "resume",
            is_replay=robot.is_replay,
            is_revoked=robot.revoked is not None,
        )
        return situation_of(facts)

    def _alerts(self, robot_id: str) -> Iterable[Condition]:
        """The conditions that hold for a robot now."""
        return (
            one.condition
            for one in self._evaluator.alerts.waiting
            if one.cleared is None and one.condition.robot_id == robot_id
        )

    def _whom(self, robot: RobotState, alert: Condition, now: Instant) -> Near | None:
        """Whom an alert is about; its own distance is of this moment."""
        about, distance_m = alert.slots.get("person"), alert.slots.get("distance")
        if not isinstance(about, str):
            return None
        found = self._near(robot, about, now)
        if found is None or not isinstance(distance_m, float):
            return found
        return replace(found, distance_m=distance_m)

    def _reported(
        self,
        robot: RobotState,
        report: SafetyReport,
        limit: SpeedLimit,
        now: Instant,
    ) -> Near | None:
        """Whom a robot says that it is slow for.

        It judges alerts by its own pose, too, and may be ahead of our speed limit; it
        then names the alert.
        """
        if report.reason not in HAZARDS:
            return None
        if report.reason == limit.reason and report.cause in (None, limit.cause):
            return self._limited(robot, limit, now)
        known = self._evaluator.people.known.values()
        named = {report.decision_id, report.cause} - {None}
        found = next(
            (one for one in known if {one.decision_id, one.person_id} & named), None
        )
        if found is not None:
            return self._to_person(robot, found, now)
        return self._near(robot, report.cause, now) or Near(report.reason)

    def _limited(
        self, robot: RobotState, limit: SpeedLimit, now: Instant
    ) -> Near | None:
        """Whom our speed limit is for."""
        if limit.reason not in HAZARDS:
            return None
        found = self._near(robot, limit.cause, now)
        return replace(
            found or Near(limit.reason),
            kind=limit.reason,
            about=limit.cause,
            distance_m=limit.distance_m,
            foretold_s=limit.foretold_s,
        )

    def _near(self, robot: RobotState, about: str | None, now: Instant) -> Near | None:
        """A person or robot by its id; None where nothing of it is known."""
        peer = self._evaluator.world.robots.get(about or "")
        if peer is None:
            return self._person(robot, about, now)
        if peer.odometry is None or robot.odometry is None:
            return Near("robot", about)
        place = peer.odometry.pose
        return Near("robot", about, robot.odometry.pose.distance_to(place.x, place.y))

    def _person(
        self, robot: RobotState, person_id: str | None, now: Instant
    ) -> Near | None:
        known = self._evaluator.people.known.get(person_id or "")
        return None if known is None else self._to_person(robot, known, now)

    def _to_person(
        self, robot: RobotState, person: TrackedPerson, now: Instant
    ) -> Near:
        """A person, or a robot that is not of the fleet."""
        x, y = person.newest.x, person.newest.y
        lane = self._evaluator.greenhouse.lane_at(x, y)
        odometry = robot.odometry
        distance_m = None if odometry is None else odometry.pose.distance_to(x, y)
        return Near(
            person.class_,
            person.person_id,
            distance_m,
            lane,
            unseen_s=person.age_s(now),
        )


def fresh_report(robot: RobotState, now: Instant) -> SafetyReport | None:
    """A robot's newest report, while that says something of now."""
    received = robot.safety_received
    if received is None or now.mono - received.mono > LIMITS.report_stale_s:
        return None
    return robot.safety
