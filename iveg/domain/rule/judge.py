"""Speed limits of the fleet at one moment, with their causes: the rule itself.

Algorithms 2 and 3 of the paper; comments quote their lines.  A robot inside the zone of
a person or of a moving peer, or about to reach it, is limited to half speed.  It is
released once it has been 0.3 m outside the zone for 1.0 s, so that noise does not flap
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

# A limit names one cause, and a person goes before a peer.
_GRAVEST = ("person", "robot")


class SpeedLimits:
    """Keeps the zone entries of the fleet and gives every robot its speed limit.

    Attributes:
        unmet: Clear conditions that each robot does not meet, by the last judgement.
        encounters: Encounters by the last forecast (every 0.2 s).
    """

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._greenhouse = greenhouse
        self._open: dict[str, dict[str, ZoneEntry]] = {}
        """Entries by robot and cause."""
        self.unmet: Mapping[str, tuple[ClearCondition, ...]] = {}
        self.encounters: Encounters = {}
        self._looked_at = -math.inf
        self._fastest: dict[str, float] = {}
        """Greatest speed of each slow robot, before it slowed and since (m/s)."""

    def copy(self) -> "SpeedLimits":
        """Copy with the same entries and encounters."""
        other = SpeedLimits(self._greenhouse)
        other._open = {name: {**entries} for name, entries in self._open.items()}
        other.encounters, other._looked_at = self.encounters, self._looked_at
        other._fastest = {**self._fastest}
        return other

    @property
    def entries(self) -> Iterable[ZoneEntry]:
        """Every zone entry that has begun and not ended."""
        return [entry for entries in self._open.values() for entry in entries.values()]

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
        return {name: self._speed_limit(name) for name in self.unmet}, changes

    def _look_ahead(
        self, world: World, zones: Iterable[Zone], rule: DetectionRule, now: Instant
    ) -> None:
        """Forecast encounters, five times a second."""
        if not rule.foresight:
            self.encounters, self._looked_at = {}, -math.inf
        elif not 0.0 <= now.mono - self._looked_at < EVERY_S - 1e-6:
            self._looked_at = now.mono
            self._fastest = {
                robot_id: max(
                    self._fastest.get(robot_id, 0.0),
                    # A robot that gave way early had perhaps not reached its speed yet.
                    world.robots[robot_id].track.motion.speed,
                    *(entry.speed_before for entry in entries.values()),
                )
                for robot_id, entries in self._open.items()
                if entries
            }
            self.encounters = look_ahead(world, zones, rule, now, self._fastest)

    def _soon_inside(
        self, robot: RobotState, world: World, now: Instant
    ) -> dict[str, Distance]:
        """Zones that count as if the robot were at their border now.

        An encounter counts as soon as only the time for slowing down is left, and at
        once where the robot gives way.  A robot that slowed for a cause stays slow
        while it would reach it, at the earlier speed too: else the robot would speed up
        into the zone.
        """
        encounters = self.encounters.get(robot.robot_id)
        if robot.odometry is None or not encounters:
            return {}
        entries = self._open.get(robot.robot_id, {})
        on_path = [item for item in encounters.values() if item.effect == "slows"]
        zones_near = [item.zone for item in on_path]
        zones_near += [entry.zone for entry in entries.values()]
        yields_to = gives_way_to(robot, zones_near, world, now)
        soon_s = slows_within_s(robot.profile.braking, robot.track.motion.speed)
        soon = {item.zone.cause for item in on_path if item.in_s <= soon_s}
        pose, counted = robot.odometry.pose, {*soon, *yields_to, *entries}
        zones = [item.zone for cause, item in encounters.items() if cause in counted]
        return {
            zone.cause: Distance(0.0, pose.distance_to(zone.x, zone.y), zone)
            for zone in zones
        }

    def _enter_and_leave(
        self, robot: RobotState, near: Distances, now: Instant, ids: Iterator[str]
    ) -> Iterator[LimitChange]:
        """Begin, continue and end the entries of one robot."""
        entries = self._open.setdefault(robot.robot_id, {})
        for cause, (outside_m, centre_m, zone) in near.items():
            if cause in entries:
                entries[cause] = entries[cause].moved(outside_m, centre_m, now)
            elif outside_m <= 0.0:
                foretold_s = self._foretold_s(robot.robot_id, zone, centre_m)
                entries[cause] = enter(
                    robot, near[cause], self._greenhouse, foretold_s, now, next(ids)
                )
                yield LimitChange(entries[cause], began=True)
        for cause, entry in list(entries.items()):
            if cause not in near:
                # No zone of this cause is left: its time outside begins or goes on.
                entry = entries[cause] = entry.moved(math.inf, entry.distance_m, now)
            if entry.is_over(now):
                del entries[cause]
                yield LimitChange(entry, began=False)

    def _foretold_s(self, robot_id: str, zone: Zone, distance_m: float) -> float | None:
        """Forecast time to a cause's zone (s); None: the robot is inside, or leaves."""
        encounter = self.encounters.get(robot_id, {}).get(zone.cause)
        if encounter is None or encounter.effect == "holds":
            return None
        return None if distance_m <= zone.radius_m else encounter.in_s

    def _speed_limit(self, robot_id: str) -> SpeedLimit:
        """Limit of a robot by its gravest zone entry, else by an unmet condition."""
        entries = self._open.get(robot_id)
        if entries:
            worst = min(
                entries.values(),
                key=lambda entry: (_GRAVEST.index(entry.zone.reason), entry.distance_m),
            )
            return SpeedLimit(
                HALF_SPEED,
                worst.zone.reason,
                worst.zone.cause,
                worst.distance_m,
                worst.decision_id,
                self._foretold_s(robot_id, worst.zone, worst.distance_m),
                all(entry.outside_since is not None for entry in entries.values()),
            )
        for first in self.unmet[robot_id]:
            return SpeedLimit(HALF_SPEED, first.limit_reason, first.robot_id)
        return CLEAR
