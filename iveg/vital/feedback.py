"""Feedback to the fleet (Algorithm 2, line 12): one message for each observer."""

from collections.abc import Iterable, Mapping

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import Feedback, FeedbackAlert, SpeedLimit
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, Origin
from iveg.domain.parameters import sent_to_robots
from iveg.domain.robot_state import RobotState
from iveg.domain.stamps import format_stamp
from iveg.vital.core import Core

MOST_ALERTS = 256
"""Most alerts in a feedback; a robot refuses more."""


class FeedbackPublisher:
    """Writes the feedback and hands it to the fleet.

    One ``seq`` counts over all topics of a boot of iVeg, so that a robot's echo names a
    single message (docs/interfaces/mqtt.md).

    Args:
        core: It has the world, the people and the fleet.
        other: Receipt of each robot's newest confident object of another class.
    """

    def __init__(self, core: Core, other: Mapping[str, Instant]) -> None:
        self.published_at = float("-inf")
        self._world, self._people = core.world, core.people
        self._other, self._boot = other, core.boot
        self._fleet, self._probe = core.ports.fleet, core.health_monitor.probe
        self._seq = 0

    def publish(
        self, speed_limits: Mapping[str, SpeedLimit], rule: DetectionRule, now: Instant
    ) -> None:
        """Send every robot its feedback."""
        self.published_at = now.mono
        alerts = _newest(tuple(self._alerts(rule, now)))
        seen = {
            robot.robot_id: robot.safety.origin.seq
            for robot in self._world.robots.values()
            if robot.safety is not None and robot.safety.origin.seq is not None
        }
        robots = self._world.robots
        first, last = self._seq + 1, self._seq + len(robots)
        # Noted before any robot has it: a moment too early makes no age look younger.
        self._world.ledger.composed(self._boot, first, last, now.mono)
        for robot in robots.values():
            self._seq += 1
            self._fleet.publish_feedback(
                self._feedback(robot, alerts, speed_limits, seen, rule, now)
            )

    def _feedback(
        self,
        robot: RobotState,
        alerts: tuple[FeedbackAlert, ...],
        speed_limits: Mapping[str, SpeedLimit],
        seen: Mapping[str, int],
        rule: DetectionRule,
        now: Instant,
    ) -> Feedback:
        own_alerts = [alert for alert in alerts if alert.observer == robot.robot_id]
        newest = max(own_alerts, key=lambda alert: alert.stamp, default=None)
        # Algorithm 2: any other confident class is only a time stamp.
        if newest is None and robot.robot_id in self._other:
            stamp = format_stamp(self._other[robot.robot_id].wall)
            newest = FeedbackAlert("", stamp)
        odometry = None if robot.is_replay else robot.odometry
        return Feedback(
            robot.robot_id,
            Origin(self._boot, self._seq, format_stamp(now.wall)),
            newest,
            alerts,
            None if odometry is None else odometry.pose,
            None if odometry is None else odometry.twist,
            None if odometry is None else odometry.origin.stamp,
            speed_limits,
            seen,
            self._probe.lag(now),
            rule.foresight,
            sent_to_robots(rule),
        )

    def _alerts(self, rule: DetectionRule, now: Instant) -> Iterable[FeedbackAlert]:
        for person in self._people.known.values():
            for sighting, radius in self._people.zone_radii(person, rule, now):
                # A recording saw somebody long ago, who must not slow a robot of today.
                if self._world.robots[sighting.observer].is_replay:
                    continue
                is_seen = sighting.age_s(now) <= LIMITS.seen_s
                yield FeedbackAlert(
                    person.decision_id,
                    format_stamp(sighting.at.wall),
                    person.class_,
                    sighting.class_id,
                    sighting.confidence,
                    (sighting.x, sighting.y, sighting.z),
                    radius,
                    sighting.observer,
                    (sighting.vx, sighting.vy) if is_seen else None,
                )


def _newest(alerts: tuple[FeedbackAlert, ...]) -> tuple[FeedbackAlert, ...]:
    """The newest alerts, as many as a robot reads; speed limits count all of them."""
    if len(alerts) <= MOST_ALERTS:
        return alerts
    return tuple(sorted(alerts, key=lambda alert: alert.stamp)[-MOST_ALERTS:])
