"""Speed limits of the fleet at one moment, with their causes.

A robot inside the ring of a person or of a moving peer is limited to half speed;
it is let go 0.3 m outside the ring and 1.0 s later, so that noise does not flap
(docs/safety.md, "The rule").  The least factor counts, never the product.  Outside all
rings a robot is clear only while every premise of that claim holds (``premises``).
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, replace
from itertools import count
from types import MappingProxyType

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import CLEAR, HALF_SPEED, SpeedLimit
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.foresight import Encounter, Foresight, Foretold
from iveg.domain.rule.obstacles import CAUSE, SeenBy, SeenObstacle
from iveg.domain.rule.paths import HOLDS_S, slows_within_s
from iveg.domain.rule.premises import Missing, missing_premises
from iveg.domain.rule.right_of_way import gives_way_to
from iveg.domain.rule.zones import NOT_FAR_M, Zone, ZoneFinder
from iveg.domain.tracking.people import People
from iveg.domain.world import World

SPEEDING_UP = 0.05
"""Faster than in the mean of its last second by more than this (m/s)."""
_GRAVEST = ("person", "robot", "obstacle")
_FREED_S = 1.0
"""So long after it was let go a robot may still be about as slow as before."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """One robot inside one ring, from trigger to release.

    Attributes:
        zone: The nearest circle of the cause at trigger.
        distance_m: Now; ``entered_m`` at the trigger.
        outside_since: When it was first found outside (monotonic, s).
        already_slow: It was slowed for something else: no slow-down will be seen.
        ahead: It had judged this very zone itself and said so before.
        foretold_s: When it would reach the ring, at the trigger (s); None: it was
            inside.
        speeding_up: It had not reached the speed that it wanted, so half of that may
            be more than half of what it drove.
        in_sight: Whether the robot saw it itself, or had a line of sight to the centre
            at the trigger.
    """

    decision_id: str
    robot_id: str
    zone: Zone
    entered: Instant
    entered_m: float
    speed_before: float
    in_sight: bool
    distance_m: float
    already_slow: bool = False
    ahead: bool = False
    speeding_up: bool = False
    outside_since: float | None = None
    foretold_s: float | None = None


@dataclass(frozen=True, slots=True)
class LimitChange:
    """A crossing that began or ended."""

    crossing: Crossing
    began: bool


class SpeedLimits:
    """Keeps the crossings of the fleet and gives every robot its speed limit.

    Attributes:
        missing: What the claim "clear" lacks for each robot, since the last judgement.
        limited_since: When each limited robot was first limited (monotonic, s).
        foretold: Encounters ahead, since the last judgement.

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
        self.foretold: Foretold = {}

    def copy(self) -> "SpeedLimits":
        """Another with the same crossings and forecasts."""
        other = SpeedLimits(self._greenhouse, self._seen)
        other._open = {name: {**mine} for name, mine in self._open.items()}
        other._foresight = copy(self._foresight)
        other.limited_since = {**self.limited_since}
        return other

    @property
    def crossings(self) -> Iterable[Crossing]:
        """Every crossing that has begun and not ended."""
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
        near = self._zones.near(world, people, rule, now, self._open)
        seen, ids = self._seen(now), (f"{new_id}-{number}" for number in count())
        self.foretold = self._foretell(world, people, rule, seen, now)
        changes: list[LimitChange] = []
        for robot in world.robots.values():
            if robot.odometry is None:
                continue
            mine = self._open.setdefault(robot.robot_id, {})
            met = _nearest(robot, near(robot), mine)
            met |= _beside(seen.get(robot.robot_id))
            met |= self._foreseen(robot, mine, world, now)
            if met or mine:
                changes += self._cross(robot, mine, met, now, ids)
        self.missing = missing_premises(world, now)
        return self._limit(world, now), changes

    def _limit(self, world: World, now: Instant) -> dict[str, SpeedLimit]:
        """The limit of every robot; notes since when it is limited."""
        limits = {name: self._speed_limit(name) for name in world.robots}
        for name, limit in limits.items():
            if limit.speed_factor > HALF_SPEED:
                self.limited_since.pop(name, None)
            else:
                self.limited_since.setdefault(name, now.mono)
        return limits

    def _foretell(
        self,
        world: World,
        people: People,
        rule: DetectionRule,
        seen: Mapping[str, SeenObstacle],
        now: Instant,
    ) -> Foretold:
        if not rule.foresight:
            self._foresight = Foresight()
            return {}
        before = self._speeds_before() if self._foresight.is_due(now) else {}
        ahead = self._foresight.look(world, people, rule, now, before)
        return _with_obstacles(ahead, seen, rule)

    def _speeds_before(self) -> Mapping[str, float]:
        """Of the robots that are slow now (m/s)."""
        return {
            robot_id: max(one.speed_before for one in mine.values())
            for robot_id, mine in self._open.items()
            if mine
        }

    def _foreseen(
        self,
        robot: RobotState,
        mine: Mapping[str, Crossing],
        world: World,
        now: Instant,
    ) -> "_Found":
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
        met: "_Found",
        now: Instant,
        ids: Iterator[str],
    ) -> Iterator[LimitChange]:
        for cause, (depth, distance, zone) in met.items():
            crossing = mine.get(cause)
            if crossing is not None:
                mine[cause] = _still(crossing, depth, distance, now)
            elif depth <= 0.0:
                crossing = self._enter(robot, zone, distance, now, next(ids))
                mine[cause] = crossing
                yield LimitChange(crossing, began=True)
        yield from _leave(mine, met, now)

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
            already_slow=_is_slow_already(robot, zone, speed),
            ahead=_is_ahead(robot, zone),
            speeding_up=_is_speeding_up(robot, now),
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
_Found = dict[str, tuple[float, float, Zone]]
"""Cause → the deepest of its circles: how far outside (m), distance (m), the circle."""


def _beside(seen: SeenObstacle | None) -> _Found:
    """What its laser sees within two metres of a robot's outline."""
    if seen is None or seen.ahead is not None:
        return {}
    return {CAUSE: (0.0, seen.distance_m, seen.zone)}


def _with_obstacles(
    foretold: Foretold, seen: Mapping[str, SeenObstacle], rule: DetectionRule
) -> Foretold:
    """Encounters with those whom lasers see before robots, too."""
    met = {
        name: {**foretold.get(name, {}), CAUSE: one.ahead}
        for name, one in seen.items()
        if one.ahead is not None and rule.foresees(one.ahead.in_s)
    }
    return {**foretold, **met} if met else foretold


def _nearest(
    robot: RobotState, zones: Iterable[Zone], mine: Mapping[str, Crossing]
) -> _Found:
    """The deepest circle of each cause: how far outside (m), distance (m), the circle.

    Causes that the robot is far from and was not near to are left out.
    """
    nearest: _Found = {}
    if robot.odometry is None:
        return nearest
    pose, robot_id = robot.odometry.pose, robot.robot_id
    for zone in zones:
        cause, reach = zone.cause, zone.radius_m + NOT_FAR_M
        dx, dy = zone.x - pose.x, zone.y - pose.y
        if dx * dx + dy * dy > reach * reach and cause not in mine:
            continue
        if cause == robot_id or zone.recording not in (None, robot.recording):
            continue
        distance = pose.distance_to(zone.x, zone.y)
        depth = distance - zone.radius_m
        if cause not in nearest or depth < nearest[cause][0]:
            nearest[cause] = depth, distance, zone
    return nearest


def _leave(
    mine: dict[str, Crossing], near: Mapping[str, object], now: Instant
) -> Iterator[LimitChange]:
    for cause, crossing in list(mine.items()):
        if cause not in near and crossing.outside_since is None:
            crossing = replace(crossing, outside_since=now.mono)
            mine[cause] = crossing
        since = crossing.outside_since
        if since is not None and now.mono - since >= LIMITS.release_after_s:
            del mine[cause]
            yield LimitChange(crossing, began=False)


def _still(crossing: Crossing, depth: float, distance: float, now: Instant) -> Crossing:
    """A crossing that continues, or whose robot has just left the circle."""
    since = None
    if depth > LIMITS.release_beyond_m:
        since = crossing.outside_since or now.mono
    if distance == crossing.distance_m and since == crossing.outside_since:
        return crossing
    return replace(crossing, distance_m=distance, outside_since=since)


def _is_speeding_up(robot: RobotState, now: Instant) -> bool:
    """Whether a robot has not reached the speed that it wants."""
    was_freed = now.mono - robot.freed_at < _FREED_S
    return was_freed or robot.speed_gained() > SPEEDING_UP


def _is_slow_already(robot: RobotState, zone: Zone, speed: float) -> bool:
    """Whether a robot will show no slow-down, because it drives slowly already.

    A robot judges alerts by its own pose, too, and may report this very zone a few
    milliseconds before it is found here; while it is still fast, its slow-down is yet
    to be seen.
    """
    if robot.safety is None or robot.safety.speed_factor > HALF_SPEED:
        return False
    slow = HALF_SPEED * robot.profile.max_speed
    return not _is_ahead(robot, zone) or speed <= slow


def _is_ahead(robot: RobotState, zone: Zone) -> bool:
    """Whether the robot already reports that it is slow for this very hazard."""
    report = robot.safety
    if report is None or report.speed_factor > HALF_SPEED:
        return False
    if zone.reason == report.reason == "obstacle":
        return True
    # A peer's own ring has no alert, and a robot may name none: that is no match.
    ours = {zone.alert_id, zone.cause} - {None}
    return report.decision_id in ours or report.cause in ours
