"""Facts about each robot, gathered for its situation (``domain/situation``)."""

from dataclasses import dataclass, replace

from iveg.domain.events import Condition
from iveg.domain.feedback import SpeedLimit
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.robot_state import RobotState, slow_below
from iveg.domain.situation import (
    HAZARDS,
    Near,
    RobotFacts,
    Situation,
    situation_of,
    told_of,
)
from iveg.domain.stop.machine import StopMachine
from iveg.domain.tracking.person import TrackedPerson
from iveg.vital.evaluate import Evaluator

_AT_A_ZONE_M = 0.5
"""Somebody so far outside of a zone stands at its edge, by the noise of both places."""


class Situations:
    """Reads the pipeline's state; keeps nothing.

    Args:
        evaluator: Whose world, people and alerts.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator

    def of(self, robot: RobotState, machine: StopMachine, now: Instant) -> Situation:
        """Situation of one robot."""
        limit = self._evaluator.speed_limits[robot.robot_id]
        report, alerts = fresh_report(robot, now), self._alerts(robot.robot_id)
        around = _Surroundings(self._evaluator, robot, now)
        once, out = machine.once, robot.detector.out_of_service
        facts = RobotFacts(
            robot_id=robot.robot_id,
            link=robot.link(now),
            age_s=robot.age_s(now),
            stands=robot.stands,
            is_slow=robot.motion(now).speed <= slow_below(robot.profile),
            report=report,
            limit=limit,
            unmet=self._evaluator.unmet(robot.robot_id),
            doubts=robot.doubts.active(now),
            alerts=alerts,
            alert_about=around.of_alert(alerts[0]) if alerts else None,
            near=None if report is None else around.of_report(report, limit),
            told_near=around.of_limit(limit),
            stop=machine.state,
            is_resuming=once is not None and once.kind == "resume",
            out_of_service_by=None if out is None else out.by,
            is_replay=robot.is_replay,
            is_refused=robot.refused,
        )
        return situation_of(facts)

    def _alerts(self, robot_id: str) -> list[Condition]:
        """Conditions of a robot or the fleet that are a situation."""
        return told_of(
            one.condition
            for one in self._evaluator.alerts.waiting
            if one.cleared is None and one.condition.robot_id in (robot_id, None)
        )


@dataclass(frozen=True, slots=True)
class _Surroundings:
    """People and robots around one robot at one moment."""

    evaluator: Evaluator
    robot: RobotState
    now: Instant

    def of_alert(self, alert: Condition) -> Near | None:
        """Person or robot of an alert, at the distance that the alert says."""
        about, distance_m = alert.slots.get("person"), alert.slots.get("distance")
        if not isinstance(about, str):
            return None
        found = self._named(about)
        if found is not None and isinstance(distance_m, float):
            found = replace(found, distance_m=distance_m)
        return self._nearest(found)

    def of_report(self, report: SafetyReport, limit: SpeedLimit) -> Near | None:
        """Person or robot that a robot reports as its reason.

        It judges alerts by its own pose, too, and may be ahead of our speed limit; it
        then names the alert.
        """
        if report.reason not in HAZARDS:
            return None
        return self._nearest(self._cause(report, limit))

    def of_limit(self, limit: SpeedLimit) -> Near | None:
        """Person or robot of our speed limit."""
        return self._nearest(self._limited(limit)) if limit.reason in HAZARDS else None

    def _cause(self, report: SafetyReport, limit: SpeedLimit) -> Near:
        if report.reason == limit.reason and report.cause in (None, limit.cause):
            return self._limited(limit)
        named = {report.decision_id, report.cause} - {None}
        for one in self.evaluator.people.known.values():
            if {one.decision_id, one.person_id} & named:
                return self._person(one)
        seen = self._named(report.cause)
        return seen or Near(report.reason, distance_m=_to_obstacle(self.robot, report))

    def _limited(self, limit: SpeedLimit) -> Near:
        return replace(
            self._named(limit.cause) or Near(limit.reason),
            kind=limit.reason,
            about=limit.cause,
            distance_m=limit.distance_m,
            foretold_s=limit.foretold_s,
        )

    def _nearest(self, near: Near | None) -> Near | None:
        """The person to name: the nearest who is seen now, else who slows the robot.

        The place of somebody who is out of sight is no distance to anybody, so whoever
        stands about as near as a zone is wide comes first.
        """
        if near is None or near.kind != "person":
            return near
        people = self.evaluator.people
        seen = (
            self._person(one)
            for one in people.known.values()
            if one.class_ == "person"
            and one.age_s(self.now) <= LIMITS.seen_s
            and people.things.explain(one, self.now) is None
        )
        placed = [one for one in seen if one.distance_m is not None]
        found = min(placed, key=_distance, default=near)
        radius_m = self.evaluator.rule.radius_m.of("person")
        reach_m = max(_distance(near), radius_m + _AT_A_ZONE_M)
        if found.about == near.about or _distance(found) > reach_m:
            return near
        return found

    def _named(self, about: str | None) -> Near | None:
        """A person or robot by its id; None where nothing of it is known."""
        peer = self.evaluator.world.robots.get(about or "")
        if peer is None:
            known = self.evaluator.people.known.get(about or "")
            return None if known is None else self._person(known)
        if peer.odometry is None or self.robot.odometry is None:
            return Near("robot", about)
        place = peer.odometry.pose
        distance_m = self.robot.odometry.pose.distance_to(place.x, place.y)
        return Near("robot", about, distance_m)

    def _person(self, person: TrackedPerson) -> Near:
        """A person, or a robot that is not of the fleet."""
        x, y = person.newest.x, person.newest.y
        odometry = self.robot.odometry
        return Near(
            person.class_,
            person.person_id,
            None if odometry is None else odometry.pose.distance_to(x, y),
            self.evaluator.greenhouse.lane_at(x, y),
            unseen_s=person.age_s(self.now),
        )


def _distance(near: Near) -> float:
    return 0.0 if near.distance_m is None else near.distance_m


def fresh_report(robot: RobotState, now: Instant) -> SafetyReport | None:
    """A robot's newest report, while that says something of now."""
    received = robot.safety_received
    if received is None or now.mono - received.mono > LIMITS.report_stale_s:
        return None
    return robot.safety


def _to_obstacle(robot: RobotState, report: SafetyReport) -> float | None:
    """Distance to what a robot's laser sees (m); None: nothing, or nobody knows."""
    obstacle, odometry = report.obstacle, robot.odometry
    if report.reason != "obstacle" or obstacle is None or odometry is None:
        return None
    return odometry.pose.distance_to(obstacle.x, obstacle.y)
