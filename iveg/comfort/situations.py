"""What is known of each robot, gathered for its situation (``domain/situation``)."""

from dataclasses import replace

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
        """How it stands with one robot."""
        limit = self._evaluator.speed_limits[robot.robot_id]
        report, alerts = fresh_report(robot, now), self._alerts(robot.robot_id)
        once = machine.once
        out = robot.detector.out_of_service
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
            alert_about=self._whom(robot, alerts[0], now) if alerts else None,
            near=None if report is None else self._reported(robot, report, limit, now),
            told_near=self._limited(robot, limit, now),
            stop=machine.state,
            is_resuming=once is not None and once.kind == "resume",
            out_of_service_by=None if out is None else out.by,
            is_replay=robot.is_replay,
            is_refused=robot.refused,
        )
        return situation_of(facts)

    def _alerts(self, robot_id: str) -> list[Condition]:
        """What holds for a robot or the fleet now and is a situation."""
        return told_of(
            one.condition
            for one in self._evaluator.alerts.waiting
            if one.cleared is None and one.condition.robot_id in (robot_id, None)
        )

    def _whom(self, robot: RobotState, alert: Condition, now: Instant) -> Near | None:
        """Whom an alert is about; its own distance is of this moment."""
        about, distance_m = alert.slots.get("person"), alert.slots.get("distance")
        if not isinstance(about, str):
            return None
        found = self._near(robot, about, now)
        if found is not None and isinstance(distance_m, float):
            found = replace(found, distance_m=distance_m)
        return self._nearest(robot, found, now)

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
        return self._nearest(robot, self._cause(robot, report, limit, now), now)

    def _cause(
        self,
        robot: RobotState,
        report: SafetyReport,
        limit: SpeedLimit,
        now: Instant,
    ) -> Near:
        if report.reason == limit.reason and report.cause in (None, limit.cause):
            return self._told(robot, limit, now)
        known = self._evaluator.people.known.values()
        named = {report.decision_id, report.cause} - {None}
        found = next(
            (one for one in known if {one.decision_id, one.person_id} & named), None
        )
        if found is not None:
            return self._to_person(robot, found, now)
        seen = self._near(robot, report.cause, now)
        return seen or Near(report.reason, distance_m=_to_obstacle(robot, report))

    def _limited(
        self, robot: RobotState, limit: SpeedLimit, now: Instant
    ) -> Near | None:
        """Whom our speed limit is for."""
        if limit.reason not in HAZARDS:
            return None
        return self._nearest(robot, self._told(robot, limit, now), now)

    def _told(self, robot: RobotState, limit: SpeedLimit, now: Instant) -> Near:
        found = self._near(robot, limit.cause, now)
        return replace(
            found or Near(limit.reason),
            kind=limit.reason,
            about=limit.cause,
            distance_m=limit.distance_m,
            foretold_s=limit.foretold_s,
        )

    def _nearest(
        self, robot: RobotState, near: Near | None, now: Instant
    ) -> Near | None:
        """The person to name: the nearest who is seen now, else who slows the robot.

        The place of somebody who is out of sight is no distance to anybody, so whoever
        stands about as near as a zone is wide comes first.
        """
        if near is None or near.kind != "person":
            return near
        seen = (
            self._to_person(robot, one, now)
            for one in self._evaluator.people.known.values()
            if one.class_ == "person"
            and one.age_s(now) <= LIMITS.seen_s
            and self._evaluator.people.things.explain(one, now) is None
        )
        placed = [one for one in seen if one.distance_m is not None]
        found = min(placed, key=_distance, default=near)
        radius_m = self._evaluator.rule.radius_m.of("person")
        reach_m = max(_distance(near), radius_m + _AT_A_ZONE_M)
        if found.about == near.about or _distance(found) > reach_m:
            return near
        return found

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
