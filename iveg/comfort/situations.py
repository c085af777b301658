"""Facts of each robot, gathered for its situation (``domain/situation``)."""

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
    """Reads the pipeline's state; keeps nothing."""

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator

    def of(self, robot: RobotState, machine: StopMachine, now: Instant) -> Situation:
        """Situation of one robot."""
        around = _Around(self._evaluator, robot, now)
        limit = self._evaluator.speed_limits[robot.robot_id]
        report, alerts = fresh_report(robot, now), self._alerts(robot.robot_id)
        order, out = machine.once, robot.detector.out_of_service
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
            alert_about=around.alert(alerts[0]) if alerts else None,
            near=None if report is None else around.reported(report, limit),
            told_near=around.limited(limit),
            stop=machine.state,
            is_resuming=order is not None and order.kind == "resume",
            out_of_service_by=None if out is None else out.by,
            is_replay=robot.is_replay,
            is_refused=robot.refused,
        )
        return situation_of(facts)

    def _alerts(self, robot_id: str) -> list[Condition]:
        """Active alerts of a robot or the fleet that are a situation."""
        return told_of(
            one.condition
            for one in self._evaluator.alerts.waiting
            if one.cleared is None and one.condition.robot_id in (robot_id, None)
        )


@dataclass(frozen=True, slots=True)
class _Around:
    """People, robots and obstacles around one robot at one moment."""

    evaluator: Evaluator
    robot: RobotState
    now: Instant

    def alert(self, alert: Condition) -> Near | None:
        """The person or robot of an alert; its own distance is of this moment."""
        about, distance_m = alert.slots.get("person"), alert.slots.get("distance")
        found = self._find(about) if isinstance(about, str) else None
        if found is None:
            return None
        if isinstance(distance_m, float):
            found = replace(found, distance_m=distance_m)
        return self._nearest(found)

    def limited(self, limit: SpeedLimit) -> Near | None:
        """The cause of our speed limit."""
        if limit.reason not in HAZARDS:
            return None
        return self._nearest(self._limiting(limit))

    def reported(self, report: SafetyReport, limit: SpeedLimit) -> Near | None:
        """The cause that a robot reports itself.

        It judges alerts by its own pose, too, and may be ahead of our speed limit; it
        then names the alert.
        """
        if report.reason not in HAZARDS:
            return None
        if report.reason == limit.reason and report.cause in (None, limit.cause):
            return self._nearest(self._limiting(limit))
        named = {report.decision_id, report.cause} - {None}
        for person in self.evaluator.people.known.values():
            if {person.decision_id, person.person_id} & named:
                return self._nearest(self._person(person))
        found = None if report.cause is None else self._find(report.cause)
        obstacle = Near(report.reason, distance_m=self._to_obstacle(report))
        return self._nearest(found or obstacle)

    def _limiting(self, limit: SpeedLimit) -> Near:
        found = None if limit.cause is None else self._find(limit.cause)
        return replace(
            found or Near(limit.reason),
            kind=limit.reason,
            about=limit.cause,
            distance_m=limit.distance_m,
            foretold_s=limit.foretold_s,
        )

    def _nearest(self, near: Near) -> Near:
        """The person to name: the nearest who is seen now, else who slows the robot.

        The place of somebody who is out of sight is no distance to anybody, so whoever
        stands about as near as a zone is wide comes first.
        """
        if near.kind != "person":
            return near
        people = self.evaluator.people
        seen = [
            self._person(person)
            for person in people.known.values()
            if person.class_ == "person"
            and person.age_s(self.now) <= LIMITS.seen_s
            and people.things.explain(person, self.now) is None
        ]
        placed = [one for one in seen if one.distance_m is not None]
        found = min(placed, key=_distance, default=near)
        radius_m = self.evaluator.rule.radius_m.of("person")
        reach_m = max(_distance(near), radius_m + _AT_A_ZONE_M)
        is_other = found.about != near.about and _distance(found) <= reach_m
        return found if is_other else near

    def _find(self, about: str) -> Near | None:
        """A robot or person by its id; None where nothing of it is known."""
        peer = self.evaluator.world.robots.get(about)
        if peer is None:
            known = self.evaluator.people.known.get(about)
            return None if known is None else self._person(known)
        place = None if peer.odometry is None else peer.odometry.pose
        distance_m = None if place is None else self._to(place.x, place.y)
        return Near("robot", about, distance_m)

    def _person(self, person: TrackedPerson) -> Near:
        """A person, or a robot that is not of the fleet."""
        x, y = person.newest.x, person.newest.y
        return Near(
            person.class_,
            person.person_id,
            self._to(x, y),
            self.evaluator.greenhouse.lane_at(x, y),
            unseen_s=person.age_s(self.now),
        )

    def _to_obstacle(self, report: SafetyReport) -> float | None:
        """Distance to what a robot's laser sees (m); None: nothing, or nobody knows."""
        obstacle = report.obstacle
        if report.reason != "obstacle" or obstacle is None:
            return None
        return self._to(obstacle.x, obstacle.y)

    def _to(self, x: float, y: float) -> float | None:
        """Distance from the robot (m); None without a pose."""
        odometry = self.robot.odometry
        return None if odometry is None else odometry.pose.distance_to(x, y)


def _distance(near: Near) -> float:
    return 0.0 if near.distance_m is None else near.distance_m


def fresh_report(robot: RobotState, now: Instant) -> SafetyReport | None:
    """A robot's newest report, while that says something of now."""
    received = robot.safety_received
    if received is None or now.mono - received.mono > LIMITS.report_stale_s:
        return None
    return robot.safety
