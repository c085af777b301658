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
    situation_alerts,
    situation_of,
)
from iveg.domain.stop.machine import StopMachine
from iveg.domain.tracking.tracker import TrackedPerson
from iveg.vital.evaluate import Evaluator

_AT_A_ZONE_M = 0.5
"""Tolerance (m) of "at the edge of a zone": the noise of both positions."""


class Situations:
    """Reads the pipeline's state; keeps nothing.

    Args:
        evaluator: Has the world, people and alerts.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator

    def situation(
        self, robot: RobotState, machine: StopMachine, now: Instant
    ) -> Situation:
        """Situation of one robot."""
        limit = self._evaluator.speed_limits[robot.robot_id]
        report, alerts = fresh_report(robot, now), self._alerts(robot.robot_id)
        around = _Surroundings(self._evaluator, robot, now)
        once, out = machine.order, robot.detector.out_of_service
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
            alert_about=around.near_alert(alerts[0]) if alerts else None,
            near=None if report is None else around.near_report(report, limit),
            limit_near=around.near_limit(limit),
            stop=machine.state,
            is_resuming=once is not None and once.kind == "resume",
            out_of_service_by=None if out is None else out.by,
            is_replay=robot.is_replay,
            is_refused=robot.refused,
        )
        return situation_of(facts)

    def _alerts(self, robot_id: str) -> list[Condition]:
        """Conditions of a robot or the fleet that are a situation."""
        return situation_alerts(
            alert.condition
            for alert in self._evaluator.alerts.waiting
            if alert.cleared is None and alert.condition.robot_id in (robot_id, None)
        )


@dataclass(frozen=True, slots=True)
class _Surroundings:
    """People and robots around one robot at one moment."""

    evaluator: Evaluator
    robot: RobotState
    now: Instant

    def near_alert(self, alert: Condition) -> Near | None:
        """Person or robot of an alert, at the distance that the alert says."""
        about, distance_m = alert.slots.get("person"), alert.slots.get("distance")
        if not isinstance(about, str):
            return None
        near = self._named(about)
        if near is not None and isinstance(distance_m, float):
            near = replace(near, distance_m=distance_m)
        return self._nearest(near)

    def near_report(self, report: SafetyReport, limit: SpeedLimit) -> Near | None:
        """Person or robot that a robot reports as its reason.

        A robot also judges alerts by its own pose.  So it may slow down before our
        speed limit does, and then names the alert.
        """
        if report.reason not in HAZARDS:
            return None
        return self._nearest(self._cause(report, limit))

    def near_limit(self, limit: SpeedLimit) -> Near | None:
        """Person or robot of our speed limit."""
        return self._nearest(self._limited(limit)) if limit.reason in HAZARDS else None

    def _cause(self, report: SafetyReport, limit: SpeedLimit) -> Near:
        if report.reason == limit.reason and report.cause in (None, limit.cause):
            # Both agree, and our limit knows the distance.
            return self._limited(limit)
        # A robot may name the decision, the person, or both.
        named = {report.decision_id, report.cause} - {None}
        for person in self.evaluator.people.known.values():
            if {person.decision_id, person.person_id} & named:
                return self._person(person)
        cause = self._named(report.cause)
        return cause or Near(report.reason, distance_m=_to_obstacle(self.robot, report))

    def _limited(self, limit: SpeedLimit) -> Near:
        return replace(
            self._named(limit.cause) or Near(limit.reason),
            kind=limit.reason,
            about=limit.cause,
            distance_m=limit.distance_m,
            foretold_s=limit.foretold_s,
        )

    def _nearest(self, near: Near | None) -> Near | None:
        """Person to name: the nearest in sight, else the person who slows the robot.

        The remembered place of a person out of sight is no measured distance.  So a
        person in sight within about the radius of a zone is named first.
        """
        if near is None or near.kind != "person":
            return near
        people = self.evaluator.people
        in_sight = (
            self._person(person)
            for person in people.known.values()
            if person.class_ == "person"
            and person.age_s(self.now) <= LIMITS.seen_s
            and people.things.explain(person, self.now) is None
        )
        placed = [person for person in in_sight if person.distance_m is not None]
        nearest = min(placed, key=_distance, default=near)
        radius_m = self.evaluator.rule.radius_m.for_class("person")
        reach_m = max(_distance(near), radius_m + _AT_A_ZONE_M)
        if nearest.about == near.about or _distance(nearest) > reach_m:
            return near
        return nearest

    def _named(self, about: str | None) -> Near | None:
        """A person or robot by its id; None: unknown."""
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
        """A track: a person, or a robot outside the fleet."""
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
    """A robot's newest report; None once it is too old to hold now."""
    received = robot.safety_received
    if received is None or now.mono - received.mono > LIMITS.report_stale_s:
        return None
    return robot.safety


def _to_obstacle(robot: RobotState, report: SafetyReport) -> float | None:
    """Distance to the obstacle that a robot reports (m); None: unknown or none."""
    obstacle, odometry = report.obstacle, robot.odometry
    if report.reason != "obstacle" or obstacle is None or odometry is None:
        return None
    return odometry.pose.distance_to(obstacle.x, obstacle.y)
