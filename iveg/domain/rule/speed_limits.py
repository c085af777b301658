"""Speed limits of the fleet at one moment, with their causes.

A robot inside the ring of a person or of a moving peer is limited to half speed;
it is let go 0.3 m outside the ring and 1.0 s later, so that noise does not flap
(docs/safety.md, "The rule").  The least factor counts, never the product.  Outside all
rings a robot is clear only while every premise of that claim holds (``premises``).
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
from copy import copy
from itertools import count
from types import MappingProxyType

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import CLEAR, HALF_SPEED, SpeedLimit
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.crossings import Crossing, LimitChange, leave
from iveg.domain.rule.entering import is_ahead, is_slow_already, is_speeding_up
from iveg.domain.rule.foresight import Encounter, Foresight, Foretold
from iveg.domain.rule.obstacles import CAUSE, SeenBy, SeenObstacle, with_obstacles
from iveg.domain.rule.paths import HOLDS_S, slows_within_s
from iveg.domain.rule.premises import Missing, missing_premises
from iveg.domain.rule.right_of_way import gives_way_to
from iveg.domain.rule.zones import Found, Zone, ZoneFinder, deepest
from iveg.domain.tracking.people import People
from iveg.domain.world import World

_GRAVEST = ("person", "robot", "obstacle")


class SpeedLimits:
    """Keeps the crossings of the fleet and gives every robot its speed limit.

    Attributes:
        missing: What the claim "clear" lacks for each robot, since the last judgement.
        limited_since: When each limited robot was first limited (monotonic, s).
        foretold: Encounters ahead that slow, since the last judgement.

    Args:
        seen: What robots' lasers see near them that nobody explains.
    """

    def __init__(self, greenhouse: Greenhouse, seen: SeenBy = lambda _: {}) -> None:
        self._greenhouse = greenhouse
        self._seen = seen
        self._open: dict[str, dict[str, Crossing]] = {}
        """By robot and cause."""
        self.missing: Mapping[str, tuple[Missing, ...]] = {}
        self.limited_since: dict[str, float] = {}
        self._zones = ZoneFinder()
        self._foresight = Foresight()
        self._fastest: dict[str, float] = {}
        """Of slow robots, before and since (m/s)."""
        self.foretold: Foretold = {}
        self._rule: DetectionRule | None = None
        self._judged: dict[str, tuple[object, ...]] = {}
        """Robot → what its last judgement rested on, where the same changes nothing."""
        self._limits: dict[str, SpeedLimit] = {}
        """Of the last judgement."""

    def copy(self) -> "SpeedLimits":
        """Another with the same crossings and forecasts."""
        other = SpeedLimits(self._greenhouse, self._seen)
        other._open = {name: {**mine} for name, mine in self._open.items()}
        other._foresight = copy(self._foresight)
        other._fastest = {**self._fastest}
        other.limited_since = {**self.limited_since}
        return other

    @property
    def crossings(self) -> Iterable[Crossing]:
        """Every crossing that has begun and not ended."""
        return [one for mine in self._open.values() for one in mine.values()]

    def encounters_shown(self, robot_id: str) -> Mapping[str, Encounter]:
        """Encounters ahead of a robot, those among it that slow no robot."""
        slows = self.foretold.get(robot_id, _NOBODY)
        return {**self._foresight.shown.get(robot_id, _NOBODY), **slows}

    def evaluate(
        self,
        world: World,
        people: People,
        rule: DetectionRule,
        now: Instant,
        new_id: str,
    ) -> tuple[dict[str, SpeedLimit], list[LimitChange]]:
        """Judge the whole fleet; ``new_id`` begins the ids of new decisions."""
        if rule is not self._rule:
            self._rule = rule
            self._judged.clear()
        near = self._zones.near(world, people, rule, now, self._open)
        seen, ids = self._seen(now), (f"{new_id}-{number}" for number in count())
        ahead = self._foretell(world, people, rule, now)
        self.foretold = with_obstacles(ahead, seen, rule) if rule.foresight else ahead
        again, changes = self._foresight.if_released, list[LimitChange]()
        # Should anything fail, everybody is judged anew.
        before, self._judged = self._judged, {}
        anew, judged = list[str](), dict[str, tuple[object, ...]]()
        for name, robot in world.robots.items():
            if robot.odometry is None:
                continue
            zones = near(robot)
            known = seen.get(name), ahead.get(name), again.get(name)
            rests_on = (*_premises_of(robot), *known, *zones)
            # Of most it is the very same, which is compared first.
            if rests_on == before.get(name):
                judged[name] = rests_on
                continue
            mine = self._open.setdefault(name, {})
            met = deepest(robot, zones, mine)
            met |= _beside(seen.get(name))
            met |= self._foreseen(robot, mine, world, now)
            crossed = list(self._cross(robot, mine, met, now, ids))
            changes += crossed
            anew.append(name)
            if not crossed and self._is_settled(name, world):
                judged[name] = rests_on
        missing, self.missing = self.missing, missing_premises(world, now)
        limits = self._limit(anew, missing, now)
        self._judged = judged
        return limits, changes

    def _is_settled(self, robot_id: str, world: World) -> bool:
        """Whether the same judgement again would change nothing, however much later.

        Who is about to be let go waits for the time, and right of way for a task.
        """
        mine = self._open[robot_id].values()
        return all(one.outside_since is None for one in mine) and (
            world.robots.keys().isdisjoint(self.foretold.get(robot_id, _NOBODY))
        )

    def _limit(
        self,
        anew: Collection[str],
        missing: Mapping[str, tuple[Missing, ...]],
        now: Instant,
    ) -> dict[str, SpeedLimit]:
        """The limit of every robot; notes since when it is limited.

        While nothing changes they are the very same mapping, which nobody changes.

        Args:
            anew: Who was judged anew; the others keep their limits.
            missing: What was missing as those were made.
            now: This judgement.
        """
        before, names = self._limits, anew
        if missing != self.missing or len(before) != len(missing):
            known = before.keys() - anew
            names = [
                name
                for name, lacks in self.missing.items()
                if name not in known or lacks != missing.get(name)
            ]
        if not names:
            return before
        limits = {**before}
        for name in names:
            limit = limits[name] = self._speed_limit(name)
            if limit.speed_factor > HALF_SPEED:
                self.limited_since.pop(name, None)
            else:
                self.limited_since.setdefault(name, now.mono)
        self._limits = limits
        return limits

    def _foretell(
        self,
        world: World,
        people: People,
        rule: DetectionRule,
        now: Instant,
    ) -> Foretold:
        """Encounters with people and peers."""
        if not rule.foresight:
            self._foresight = Foresight()
            return {}
        if self._foresight.is_due(now):
            self._fastest = {
                robot_id: max(
                    self._fastest.get(robot_id, 0.0),
                    # Who is slow early for a task may not have been fast yet.
                    world.robots[robot_id].fastest_lately(),
                    *(one.speed_before for one in mine.values()),
                )
                for robot_id, mine in self._open.items()
                if mine
            }
        return self._foresight.look(world, people, rule, now, self._fastest)

    def _foreseen(
        self,
        robot: RobotState,
        mine: Mapping[str, Crossing],
        world: World,
        now: Instant,
    ) -> Found:
        """Rings that a robot will reach, as if it were at their border now.

        In time to be slow there; who gives way does not wait for that.  Who is slow for
        one already stays so while it lies ahead, or would lie ahead again at the speed
        of before: it shall not speed up for that.
        """
        ahead = self.foretold.get(robot.robot_id, _NOBODY)
        again = self._foresight.if_released.get(robot.robot_id, _NOBODY)
        odometry = robot.odometry
        if odometry is None or not (ahead or again):
            return {}
        soon_s = slows_within_s(robot.profile.braking, odometry.twist.linear_x)
        yields_to = self._yields_to(robot, ahead, world, now)
        held = {cause: one for cause, one in again.items() if cause in mine}
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

    def _cross(
        self,
        robot: RobotState,
        mine: dict[str, Crossing],
        met: Found,
        now: Instant,
        ids: Iterator[str],
    ) -> Iterator[LimitChange]:
        for cause, (depth, distance, zone) in met.items():
            crossing = mine.get(cause)
            if crossing is not None:
                mine[cause] = crossing.continued(depth, distance, now)
            elif depth <= 0.0:
                crossing = self._enter(robot, zone, distance, now, next(ids))
                mine[cause] = crossing
                yield LimitChange(crossing, began=True)
        yield from leave(mine, met, now)

    def _enter(
        self,
        robot: RobotState,
        zone: Zone,
        distance: float,
        now: Instant,
        decision_id: str,
    ) -> Crossing:
        odometry = robot.odometry
        assert odometry is not None  # noqa: S101 - nothing is near without it
        pose, speed = odometry.pose, abs(odometry.twist.linear_x)
        return Crossing(
            decision_id,
            robot.robot_id,
            zone,
            entered=now,
            entered_m=distance,
            speed_before=max(speed, robot.fastest_lately()),
            # Whom its own detector found it sees, whatever leaves the plan knows of.
            in_sight=zone.observer == robot.robot_id
            or self._greenhouse.in_sight(pose.x, pose.y, zone.x, zone.y),
            distance_m=distance,
            already_slow=is_slow_already(robot, zone, speed),
            ahead=is_ahead(robot, zone),
            speeding_up=is_speeding_up(robot, now),
            foretold_s=self._foretold_s(robot.robot_id, zone, distance),
        )

    def _foretold_s(self, robot_id: str, zone: Zone, distance_m: float) -> float | None:
        """When a robot will reach a cause's ring (s); None: it is inside, or leaves."""
        encounter = self.foretold.get(robot_id, _NOBODY).get(zone.cause)
        is_inside = distance_m <= zone.radius_m
        return None if encounter is None or is_inside else encounter.in_s

    def _speed_limit(self, robot_id: str) -> SpeedLimit:
        """The most specific reason wins: what is missing comes last."""
        mine = self._open.get(robot_id)
        if mine:
            worst = min(
                mine.values(),
                key=lambda one: (_GRAVEST.index(one.zone.reason), one.distance_m),
            )
            return SpeedLimit(
                HALF_SPEED,
                worst.zone.reason,
                # A laser knows no names.
                None if worst.zone.reason == "obstacle" else worst.zone.cause,
                worst.distance_m,
                worst.decision_id,
                self._foretold_s(robot_id, worst.zone, worst.distance_m),
                all(one.outside_since is not None for one in mine.values()),
            )
        for first in self.missing[robot_id]:
            return SpeedLimit(HALF_SPEED, first.reason, first.robot_id)
        return CLEAR


_NOBODY: Mapping[str, Encounter] = MappingProxyType({})


def _premises_of(robot: RobotState) -> tuple[object, ...]:
    """What of a robot itself its judgement rests on."""
    return robot.odometry, robot.description, robot.live_at, robot.map_frame


def _beside(seen: SeenObstacle | None) -> Found:
    """What its laser sees within two metres of a robot's outline."""
    if seen is None or seen.ahead is not None:
        return {}
    return {CAUSE: (0.0, seen.distance_m, seen.zone)}
