"""Speed limits of the fleet at one moment, with their causes.

A robot inside the zone of a person or of a moving peer is limited to half speed;
it is let go 0.3 m outside the zone and 1.0 s later, so that noise does not flap
(docs/safety.md, "The rule").  The least factor counts, never the product.  Outside all
zones a robot is clear only while every condition of that claim holds (``clear``).
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
from copy import copy
from itertools import count

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import CLEAR, HALF_SPEED, SpeedLimit
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.clear import ClearCondition, unmet_conditions
from iveg.domain.rule.foresight import (
    Encounter,
    Encounters,
    Foresight,
    by_cause,
    gives_way_to,
)
from iveg.domain.rule.paths import HOLDS_S, slows_within_s
from iveg.domain.rule.zones import (
    Distances,
    LimitChange,
    Zone,
    ZoneEntry,
    distances,
    has_told,
    is_slow_already,
    leave,
    near_zones,
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
        encounters: Encounters ahead, since the last judgement.
    """

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._greenhouse = greenhouse
        self._open: dict[str, dict[str, ZoneEntry]] = {}
        """By robot and cause."""
        self.unmet: Mapping[str, tuple[ClearCondition, ...]] = {}
        self._foresight = Foresight()
        self._fastest: dict[str, float] = {}
        """Of slow robots, before and since (m/s)."""
        self.encounters: Encounters = {}
        self._limits: dict[str, SpeedLimit] = {}
        """Of the last judgement."""

    def copy(self) -> "SpeedLimits":
        """Another with the same entries and encounters."""
        other = SpeedLimits(self._greenhouse)
        other._open = {name: {**mine} for name, mine in self._open.items()}
        other._foresight = copy(self._foresight)
        other._fastest = {**self._fastest}
        return other

    @property
    def entries(self) -> Iterable[ZoneEntry]:
        """Every entry that has begun and not ended."""
        return [one for mine in self._open.values() for one in mine.values()]

    def encounters_told(self, robot_id: str) -> Mapping[str, Encounter]:
        """Encounters ahead of a robot by cause, for people to see."""
        ahead = self.encounters.get(robot_id, ())
        return {**by_cause(ahead, "tells"), **by_cause(ahead, "slows")}

    def evaluate(
        self,
        world: World,
        people: People,
        rule: DetectionRule,
        now: Instant,
        new_id: str,
    ) -> tuple[dict[str, SpeedLimit], list[LimitChange]]:
        """Judge the whole fleet; ``new_id`` begins the ids of new decisions."""
        # Algorithm 3: a circle round each alert and each peer.
        zones = list(zones_of(world, people, rule, now))
        ids = (f"{new_id}-{number}" for number in count())
        self.encounters = self._look_ahead(world, people, rule, now)
        changes = list[LimitChange]()
        robots = [*world.robots.values()]
        for robot, near in near_zones(robots, zones, self._open):
            mine = self._open.setdefault(robot.robot_id, {})
            near_by = distances(robot, near)
            # Before the circle, where the robot's own path meets it.
            near_by |= self._reached_soon(robot, mine, world, now)
            changes += self._update(robot, mine, near_by, now, ids)
        # Algorithm 2 ends in the feedback: half speed inside, full where all is clear.
        self.unmet = unmet_conditions(world, now)
        limits = {name: self._speed_limit(name) for name in self.unmet}
        # What feedback shares is written once for as long as it is the very same.
        if limits != self._limits:
            self._limits = limits
        return self._limits, changes

    def _look_ahead(
        self,
        world: World,
        people: People,
        rule: DetectionRule,
        now: Instant,
    ) -> Encounters:
        """Encounters with people and peers."""
        if not rule.foresight:
            self._foresight = Foresight()
            return {}
        if self._foresight.is_due(now):
            self._fastest = {
                robot_id: max(
                    self._fastest.get(robot_id, 0.0),
                    # Who is slow early for a task may not have been fast yet.
                    world.robots[robot_id].track.motion.speed,
                    *(one.speed_before for one in mine.values()),
                )
                for robot_id, mine in self._open.items()
                if mine
            }
        return self._foresight.look(world, people, rule, now, self._fastest)

    def _reached_soon(
        self,
        robot: RobotState,
        mine: Mapping[str, ZoneEntry],
        world: World,
        now: Instant,
    ) -> Distances:
        """Zones that a robot will reach, as if it were at their border now.

        In time to be slow there; who gives way does not wait for that.  Who is slow for
        one already stays so while it lies ahead, or would lie ahead again at the speed
        of before: it shall not speed up for that.
        """
        encounters, odometry = self.encounters.get(robot.robot_id), robot.odometry
        if odometry is None or not encounters:
            return {}
        ahead = by_cause(encounters, "slows")
        soon_s = slows_within_s(robot.profile.braking, robot.track.motion.speed)
        yields_to = self._yields_to(robot, ahead, world, now)
        holds = by_cause(encounters, "holds").items()
        held = {cause: one for cause, one in holds if cause in mine}
        near = {
            cause: one
            for cause, one in ahead.items()
            if cause in yields_to
            or one.in_s <= (max(HOLDS_S, soon_s) if cause in mine else soon_s)
        }
        distance_to = odometry.pose.distance_to
        return {
            cause: (0.0, distance_to(one.zone.x, one.zone.y), one.zone)
            for cause, one in (held | near).items()
        }

    def _yields_to(
        self,
        robot: RobotState,
        ahead: Mapping[str, Encounter],
        world: World,
        now: Instant,
    ) -> Collection[str]:
        """Peers that a robot gives way to by their tasks: nobody if people are near."""
        if world.robots.keys().isdisjoint(ahead):
            return ()
        near = self._open.get(robot.robot_id, {}).values()
        zones = [*(one.zone for one in ahead.values()), *(one.zone for one in near)]
        if any(zone.reason == "person" for zone in zones):
            return ()
        return gives_way_to(robot, ahead, world, now)

    def _update(
        self,
        robot: RobotState,
        mine: dict[str, ZoneEntry],
        near_by: Distances,
        now: Instant,
        ids: Iterator[str],
    ) -> Iterator[LimitChange]:
        """Begin, continue and end the entries of one robot."""
        for cause, (depth, distance, zone) in near_by.items():
            entry = mine.get(cause)
            if entry is not None:
                mine[cause] = entry.continued(depth, distance, now)
            elif depth <= 0.0:
                entry = self._enter(robot, zone, distance, now, next(ids))
                mine[cause] = entry
                yield LimitChange(entry, began=True)
        yield from leave(mine, near_by, now)

    def _enter(
        self,
        robot: RobotState,
        zone: Zone,
        distance: float,
        now: Instant,
        decision_id: str,
    ) -> ZoneEntry:
        odometry = robot.odometry
        assert odometry is not None  # noqa: S101 - nothing is near without it
        pose, speed = odometry.pose, robot.motion(now).speed
        return ZoneEntry(
            decision_id,
            robot.robot_id,
            zone,
            entered=now,
            entered_m=distance,
            speed_before=speed,
            # Whom its own detector found it sees, whatever leaves the plan knows of.
            in_sight=zone.observer == robot.robot_id
            or self._greenhouse.in_sight(pose.x, pose.y, zone.x, zone.y),
            distance_m=distance,
            already_slow=is_slow_already(robot, zone, speed),
            told_before=has_told(robot, zone),
            foretold_s=self._foretold_s(robot.robot_id, zone, distance),
        )

    def _foretold_s(self, robot_id: str, zone: Zone, distance_m: float) -> float | None:
        """When a robot will reach a cause's zone (s); None: it is inside, or leaves."""
        ahead = by_cause(self.encounters.get(robot_id, ()), "slows")
        encounter = ahead.get(zone.cause)
        is_inside = distance_m <= zone.radius_m
        return None if encounter is None or is_inside else encounter.in_s

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
