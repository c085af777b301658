"""What lasers see near robots and nobody explains: the second witness on the server.

It reads the scans that come anyway, with the same eye as the safety node on a robot
(``iveg.domain.witness``), for robots whose own software has none.  Here it also knows
everybody whom cameras see, and how far ahead a robot will be: what it will be within
two metres of is an encounter like any other (docs/safety.md, "The laser").

It only adds: nothing that it finds or misses lifts a limit (``tests/properties``).
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, LaserScan
from iveg.domain.obstacle import Obstacle
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.foresight import Encounter, Foretold, path_of
from iveg.domain.rule.known_here import Around, KnownHere, Somebody
from iveg.domain.rule.paths import HORIZON_S, MOVES_M_S, Circles
from iveg.domain.rule.zones import Zone
from iveg.domain.tracking.laser_sight import EXPLAINED, passes_by
from iveg.domain.tracking.people import People
from iveg.domain.tracking.sight import seen_sightings
from iveg.domain.witness import (
    GONE_S,
    PLAN_M,
    KnownBody,
    Outline,
    Plan,
    Witness,
)
from iveg.domain.world import World

CAUSE = "obstacle"
"""Stands for the id of a cause: a laser knows no names."""
_CHECKED_S, _FAULTY_S = 1.0, 5.0
_LEAST_RETURNS, _STRANGE = 0.05, 0.5
"""Shares of the beams that come back at least, and of those that the plan explains."""
_TURNS_RAD_S = 0.5
"""A robot from whose laser places are learnt turns so fast at most."""
_WATCHED_S, _SHOWN_S = 0.45, 10.0
_FOLLOW_M = 8.0
"""Beyond, too few beams meet somebody."""


@dataclass(frozen=True, slots=True)
class SeenObstacle:
    """The obstacle that a robot is slowed for first.

    Attributes:
        zone: About it, two metres wide.
        distance_m: From ``base_link`` to its middle (m).
        ahead: Where the robot reaches the zone; None: it is within two metres of the
            robot's outline.
        at: When it was seen (monotonic, s).
    """

    zone: Zone
    distance_m: float
    ahead: Encounter | None
    at: float


SeenBy = Callable[[Instant], Mapping[str, SeenObstacle]]
"""Now → what the laser of each robot sees near it."""


Fault = Literal["blind", "unfit"]
"""Next to nothing comes back; most of what does is nowhere in the plan."""


@dataclass(frozen=True, slots=True)
class _Fit:
    """How a laser fits the plan; since when, and by which scan (monotonic, s).

    Attributes:
        explained: Share of the returns that the plan explains.
    """

    fault: Fault | None
    since: float
    at: float
    explained: float


def explained_by(scan: LaserScan, pose: Pose2D, plan: Plan) -> tuple[int, float]:
    """How many beams of a scan come back; the share of them that a plan explains."""
    x, y = scan.points(pose).astype(np.float64).T
    explained = np.count_nonzero(plan.distance_to(x, y) <= PLAN_M)
    return len(x), explained / max(1, len(x))


def _fault(scan: LaserScan, fit: tuple[int, float]) -> Fault | None:
    """What is wrong with a laser by one scan, and how it fits the plan.

    A wrong mount or pose draws walls where none are; zeros, and a cover, draw none.
    """
    returns, explained = fit
    if returns < _LEAST_RETURNS * len(scan.ranges):
        return "blind"
    return "unfit" if 1.0 - explained > _STRANGE else None


Walkers = tuple[str, Instant, Sequence[tuple[float, float]]]
"""A robot, when its laser saw them, and where each is in ``map`` (m)."""


def with_obstacles(
    foretold: Foretold, seen: Mapping[str, SeenObstacle], rule: DetectionRule
) -> Foretold:
    """Encounters with those whom lasers see before robots, too."""
    met = {
        name: {**foretold.get(name, {}), CAUSE: one.ahead}
        for name, one in seen.items()
        if one.ahead is not None and rule.foresees(one.ahead.in_s)
    }
    return {**foretold, **met} if met else foretold


class Obstacles:
    """What each robot's laser sees that nobody explains.

    Args:
        plan: What stands in the greenhouse.
    """

    def __init__(self, world: World, people: People, plan: Plan) -> None:
        self._world, self._people, self._plan = world, people, plan
        self._witnesses: dict[str, Witness] = {}
        self._seen: dict[str, SeenObstacle | None] = {}
        self._newest: dict[str, SeenObstacle] = {}
        self._walkers: dict[str, tuple[Instant, Sequence[Obstacle]]] = {}
        self._fits: dict[str, _Fit] = {}
        self._ranges: dict[str, NDArray[np.float32]] = {}
        self._watched_at = -math.inf
        self._swept_at: dict[str, float] = {}
        self.known_here = KnownHere(people.things)

    def look(self, robot: RobotState, scan: LaserScan, now: Instant) -> None:
        """Take a robot's scan, made where it was when that came."""
        pose, odometry, profile = robot.scan_pose, robot.odometry, robot.profile
        if pose is None or odometry is None:
            return
        outline = Outline(profile.length, profile.width)
        witness = self._witnesses.setdefault(
            robot.robot_id, Witness(outline, self._plan, HORIZON_S, _FOLLOW_M)
        )
        known = (*self._peers(robot, now), *self._sighted(now))
        places = self.known_here.near(robot.robot_id, pose, now)
        witness.look(scan, pose, odometry.twist, known, now.mono, places)
        first = self._seen[robot.robot_id] = _first(robot, witness, now)
        if first is not None:
            self._newest[robot.robot_id] = first
        self._walkers[robot.robot_id] = now, witness.walkers
        if self._plan.is_drawn:
            self._check(scan, pose, now)
        self._watch(witness.newest, now)
        if self._is_believed(robot, scan, now):
            self._learn(robot.robot_id, scan, pose, witness.newest, now)

    def _watch(self, seen: Sequence[Obstacle], now: Instant) -> None:
        """Look whether somebody is, or something moves, where something is known."""
        moving = [one for one in seen if one.stirred]
        if now.mono - self._watched_at < _WATCHED_S:
            self.known_here.stir(moving, now)
            return
        self._watched_at = now.mono
        people = [*_people_on(self._people)]
        present = [(one.x, one.y) for one, _ in seen_sightings(self._people, now)]
        self.known_here.watch(Around(people, present, moving), now)

    def _learn(
        self,
        robot_id: str,
        scan: LaserScan,
        pose: Pose2D,
        seen: Sequence[Obstacle],
        now: Instant,
    ) -> None:
        """Learn what is beside the plan, and what is seen to be gone."""
        if self._plan.is_drawn:
            self.known_here.learn(robot_id, seen, now)
        if now.mono - self._swept_at.get(robot_id, -math.inf) >= _CHECKED_S:
            self._swept_at[robot_id] = now.mono
            passes = partial(passes_by, scan, pose.compose(scan.mount))
            self.known_here.swept(robot_id, passes, pose, now)

    def _is_believed(self, robot: RobotState, scan: LaserScan, now: Instant) -> bool:
        """Whether what a laser shows may be learnt: it fits, turns slowly, goes on."""
        odometry, fit = robot.odometry, self._fits.get(robot.robot_id)
        before = self._ranges.get(robot.robot_id)
        self._ranges[robot.robot_id] = scan.ranges
        fits = fit is not None and fit.explained >= EXPLAINED
        return (
            odometry is not None
            and abs(odometry.twist.angular_z) <= _TURNS_RAD_S
            and (fits or not self._plan.is_drawn)
            and not robot.doubts.is_open(now)
            and before is not None
            and not np.array_equal(before, scan.ranges)
        )

    def _check(self, scan: LaserScan, pose: Pose2D, now: Instant) -> None:
        """Compare a whole scan with the plan, once a second."""
        before = self._fits.get(scan.robot_id)
        if before is None or now.mono - before.at >= _CHECKED_S:
            fit = explained_by(scan, pose, self._plan)
            fault = _fault(scan, fit)
            goes_on = before is not None and before.fault == fault
            since = before.since if before is not None and goes_on else now.mono
            self._fits[scan.robot_id] = _Fit(fault, since, now.mono, fit[1])

    def fault(self, robot_id: str, now: Instant) -> Fault | None:
        """What is wrong with a robot's laser, if it is so for some seconds."""
        fit = self._fits.get(robot_id)
        if fit is None or now.mono - fit.at > _FAULTY_S:
            return None
        return fit.fault if fit.at - fit.since >= _FAULTY_S else None

    def is_unsure(self, robot_id: str) -> bool:
        """Whether the next scan of a robot may show that somebody is there."""
        witness = self._witnesses.get(robot_id)
        return witness is not None and witness.is_unsure

    def seen(self, now: Instant) -> Mapping[str, SeenObstacle]:
        """What the laser of each robot saw near it within the last half second."""
        return {
            robot_id: one
            for robot_id, one in self._seen.items()
            if one is not None and 0.0 <= now.mono - one.at <= GONE_S
        }

    def shown(self, robot_id: str, now: Instant) -> Obstacle | None:
        """What a robot was slowed for within some seconds, for whoever looks at it."""
        one = self._newest.get(robot_id)
        if one is None or now.mono - one.at > _SHOWN_S:
            return None
        return one.zone.obstacle

    def walkers(self) -> Iterator[Walkers]:
        """Who walks by the newest scan of each robot, since the last time of asking."""
        waiting, self._walkers = self._walkers, {}
        for robot_id, (at, seen) in waiting.items():
            if seen:
                yield robot_id, at, [(one.x, one.y) for one in seen]

    def _peers(self, robot: RobotState, now: Instant) -> Iterator[KnownBody]:
        """Where peers told within a second that they are."""
        for peer in self._world.live_robots():
            age, odometry = peer.age_s(now), peer.odometry
            if peer is robot or odometry is None or age is None:
                continue
            if age <= LIMITS.silence_s:
                yield KnownBody.of_peer(odometry.pose)

    def _sighted(self, now: Instant) -> Iterator[KnownBody]:
        """Where cameras see people, who have rings of their own."""
        for sighting, body in seen_sightings(self._people, now):
            if not sighting.laser:
                yield body


def _people_on(people: People) -> Iterator[Somebody]:
    """Everybody on the map and faint boxes; marks of operators take nobody away."""
    for person in people.known.values():
        newest = person.newest
        yield Somebody(person.person_id, newest.at.mono, (newest.x, newest.y))
    for one in chain.from_iterable(people.faint.values()):
        yield Somebody(None, 0.0, (one.position[0], one.position[1]))


def _first(robot: RobotState, witness: Witness, now: Instant) -> SeenObstacle | None:
    """The nearest within two metres of the outline, else the first one to be met."""
    found = [_seen(robot, one, now) for one in witness.present(now.mono)]
    known = [one for one in found if one is not None]
    return min(known, key=_soonness, default=None)


def _soonness(seen: SeenObstacle) -> tuple[float, float]:
    return (0.0 if seen.ahead is None else seen.ahead.in_s), seen.distance_m


def _seen(robot: RobotState, one: Obstacle, now: Instant) -> SeenObstacle | None:
    """An obstacle as a zone; None for one that the robot will not come near."""
    odometry, ring = robot.odometry, LIMITS.ring_default_m
    assert odometry is not None  # noqa: S101 - its scan was placed by it
    zone = Zone("obstacle", CAUSE, robot.robot_id, one.x, one.y, ring, obstacle=one)
    distance = odometry.pose.distance_to(one.x, one.y)
    if one.gap_m <= ring:
        return SeenObstacle(zone, distance, None, now.mono)
    if abs(odometry.twist.linear_x) < MOVES_M_S:
        return None
    _, meetings = Circles([(one.x, one.y, 0.0, 0.0, 0.0, ring)]).met_by(
        path_of(robot, now)
    )
    for met in meetings:
        places = met.x, met.y, met.centre_x, met.centre_y
        ahead = Encounter(zone, met.in_s, now.mono, *places)
        return SeenObstacle(zone, distance, ahead, now.mono)
    return None
