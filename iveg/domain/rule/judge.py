"""Speed limits of the fleet at one moment, with their causes: the rule itself.

Algorithms 2 and 3 of the paper; comments quote their lines.  A robot inside the zone of
a person or of a moving peer, or about to reach it, is limited to half speed.  It is let
go 0.3 m outside the zone and 1.0 s later, so that noise does not flap
(docs/safety.md, "The rule").  The least factor counts, never the product.  Outside all
zones a robot is clear only while every condition of that claim holds (``clear``).
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import count

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import CLEAR, HALF_SPEED, SpeedLimit
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.clear import ClearCondition, unmet_conditions
from iveg.domain.rule.foresight import Encounters, gives_way_to, look_ahead
from iveg.domain.rule.paths import EVERY_S, slows_within_s
from iveg.domain.rule.zones import (
    Distance,
    Distances,
    LimitChange,
    Zone,
    ZoneEntry,
    distances_to_zones,
    enter,
    zones_of,
)
from iveg.domain.tracking.people import People
from iveg.domain.world import World

_GRAVEST = ("person", "robot")


class SpeedLimits:
    """Keeps the zone entries of the fleet and gives every robot its speed limit.

    Attributes:
        unmet: Conditions of "clear" that do not hold for each robot, since the last
            judgement.
        encounters: Encounters ahead, of the last fifth of a second.
    """

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._greenhouse = greenhouse
        self._open: dict[str, dict[str, ZoneEntry]] = {}
        """Entries by robot and cause."""
        self.unmet: Mapping[str, tuple[ClearCondition, ...]] = {}
        self.encounters: Encounters = {}
        self._looked_at = -math.inf
        self._fastest: dict[str, float] = {}
        """Speed of slow robots, before and since (m/s)."""
        self._limits: dict[str, SpeedLimit] = {}
        """Limits of the last judgement."""

    def copy(self) -> "SpeedLimits":
        """Another with the same entries and encounters."""
        other = SpeedLimits(self._greenhouse)
        other._open = {name: {**mine} for name, mine in self._open.items()}
        other.encounters, other._looked_at = self.encounters, self._looked_at
        other._fastest = {**self._fastest}
        return other

    @property
    def entries(self) -> Iterable[ZoneEntry]:
        """Every entry that has begun and not ended."""
        return [one for mine in self._open.values() for one in mine.values()]

    def evaluate(
        self,
        world: World,
        people: People,
        rule: DetectionRule,
        now: Instant,
        new_id: str,
    ) -> tuple[dict[str, SpeedLimit], list[LimitChange]]:
        """Judge the whole fleet; ``new_id`` begins the ids of new decisions."""
        # Algorithm 3, line 9: "set farmer/robot pos. in local map and generate security
        # circle", of each alert (Algorithm 2, lines 4-6) and of each peer.
        zones = list(zones_of(world, people, rule, now))
        # "If the trajectory intersects with the 2-meter safety zone of a farmer or the
        # safety buffer of a peer, the recipient robot initiates a preemptive velocity
        # reduction."
        self._look_ahead(world, zones, rule, now)
        # Algorithm 3, lines 10 and 16: "if farmer_pos =< AG/odom", "if ag_robot_pos =<
        # AG/odom".
        ids = (f"{new_id}-{number}" for number in count())
        changes = list[LimitChange]()
        robots = [*world.robots.values()]
        for robot, near in distances_to_zones(robots, zones, self._open):
            near |= self._soon_inside(robot, world, now)
            changes += self._enter_and_leave(robot, near, now, ids)
        # "Speed -> 100 % upon clearance".
        self.unmet = unmet_conditions(world, now)
        # Algorithm 3, lines 11 and 17: "V_linear = V_input x 0.5".
        limits = {name: self._speed_limit(name) for name in self.unmet}
        # What feedback shares is written once for as long as it is the very same.
        if limits != self._limits:
            self._limits = limits
        return self._limits, changes

    def _look_ahead(
        self, world: World, zones: Iterable[Zone], rule: DetectionRule, now: Instant
    ) -> None:
        """Find the encounters ahead, five times a second."""
        if not rule.foresight:
            self.encounters, self._looked_at = {}, -math.inf
        elif not 0.0 <= now.mono - self._looked_at < EVERY_S - 1e-6:
            self._looked_at = now.mono
            self._fastest = {
                robot_id: max(
                    self._fastest.get(robot_id, 0.0),
                    # A robot that is slow early for a task was perhaps not fast yet.
                    world.robots[robot_id].track.motion.speed,
                    *(one.speed_before for one in mine.values()),
                )
                for robot_id, mine in self._open.items()
                if mine
            }
            self.encounters = look_ahead(world, zones, rule, now, self._fastest)

    def _soon_inside(
        self, robot: RobotState, world: World, now: Instant
    ) -> dict[str, Distance]:
        """Zones ahead that count as if the robot were at their border now.

        An encounter counts from the time on that slowing down takes, and at once where
        the robot gives way.  A robot that is slow for one stays so while it lies ahead,
        also if it would only at the speed of before: it shall not speed up for that.
        """
        ahead = self.encounters.get(robot.robot_id)
        if robot.odometry is None or not ahead:
            return {}
        mine = self._open.get(robot.robot_id, {})
        on_path = [one for one in ahead.values() if one.effect == "slows"]
        near = [*(one.zone for one in on_path), *(one.zone for one in mine.values())]
        yields_to = gives_way_to(robot, near, world, now)
        soon_s = slows_within_s(robot.profile.braking, robot.track.motion.speed)
        soon = {one.zone.cause for one in on_path if one.in_s <= soon_s}
        pose = robot.odometry.pose
        return {
            cause: Distance(0.0, pose.distance_to(one.zone.x, one.zone.y), one.zone)
            for cause, one in ahead.items()
            if cause in mine or cause in soon or cause in yields_to
        }

    def _enter_and_leave(
        self, robot: RobotState, near: Distances, now: Instant, ids: Iterator[str]
    ) -> Iterator[LimitChange]:
        """Begin, continue and end the entries of one robot."""
        mine = self._open.setdefault(robot.robot_id, {})
        for cause, one in near.items():
            if cause in mine:
                mine[cause] = mine[cause].moved(one.outside_m, one.centre_m, now)
            elif one.outside_m <= 0.0:
                foretold_s = self._foretold_s(robot.robot_id, one.zone, one.centre_m)
                sight = self._greenhouse
                mine[cause] = enter(robot, one, sight, foretold_s, now, next(ids))
                yield LimitChange(mine[cause], began=True)
        for cause, entry in list(mine.items()):
            if cause not in near:
                entry = mine[cause] = entry.moved(math.inf, entry.distance_m, now)
            if entry.is_over(now):
                del mine[cause]
                yield LimitChange(entry, began=False)

    def _foretold_s(self, robot_id: str, zone: Zone, distance_m: float) -> float | None:
        """When a robot will reach a cause's zone (s); None: it is inside, or leaves."""
        encounter = self.encounters.get(robot_id, {}).get(zone.cause)
        if encounter is None or encounter.effect == "holds":
            return None
        return None if distance_m <= zone.radius_m else encounter.in_s

    def _speed_limit(self, robot_id: str) -> SpeedLimit:
        """The most specific reason wins: an unmet condition comes last."""
        mine = self._open.get(robot_id)
        if mine:
            worst = min(
                mine.values(),
                key=lambda one: (_GRAVEST.index(one.zone.reason), one.distance_m),
            )
            return SpeedLimit(
                HALF_SPEED,
                worst.zone.reason,
                worst.zone.cause,
                worst.distance_m,
                worst.decision_id,
                self._foretold_s(robot_id, worst.zone, worst.distance_m),
                all(one.outside_since is not None for one in mine.values()),
            )
        for first in self.unmet[robot_id]:
            return SpeedLimit(HALF_SPEED, first.limit_reason, first.robot_id)
        return CLEAR
