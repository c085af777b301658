"""Encounters before they happen: whose zone each robot will reach, and when.

The paper asks for a "preemptive velocity reduction" if a robot's own path meets the
safety zone of a person.  The path is the robot's own plan where it tells one, else the
arc of its twist; people and peers go on as they were seen to go, so nobody is slowed
for what a person could do at worst.  An encounter only adds: the zone itself counts as
before (docs/safety.md, "Foresight").  More is told than slows: a robot that is slow
already, for a zone that grows while somebody is out of sight or for something else,
still has the encounter before it.  So it is of the newest step of whoever has just
stopped, turned or set out: the velocity of a chain of sightings is smoothed and follows
a walker's own by about 0.4 s; that step alone is sooner, and less sure.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.paths import (
    EVERY_S,
    HOLDS_S,
    MOVES_M_S,
    PLAN_LASTS_S,
    MovingZones,
    Path,
    path_ahead,
    sped_up,
)
from iveg.domain.rule.zones import Zone, zones_of
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Sighting, of_a_walker
from iveg.domain.world import World

_CAME_TRUE = ((0.5, 1.0, 1.5, 2.0, 2.5, 3.0), (0.98, 0.93, 0.92, 0.88, 0.83, 0.78))
"""Measured (``benchmarks.foresight``; docs/experiment.md, "Foresight")."""
_ALIKE = 1.05
"""By so much faster makes no other forecast."""
_TURNED_M_S = 0.5
"""By so much a step differs from the smoothed velocity: less is a detector's noise."""
_LEAST_S = 0.1
"""Of two sightings that are closer to each other the way is mostly error."""
_MISSED_S = 2.0
"""So long a detector may miss somebody who is there (s)."""


Effect = Literal["slows", "holds", "tells"]


@dataclass(frozen=True, slots=True)
class Encounter:
    """A robot will reach a zone.

    Attributes:
        effect: ``slows``: from the braking time on; ``holds``: it would slow a robot
            anew that is let go, which is better not let go; ``tells``: nothing but
            told.
        in_s: How soon, counted from ``at`` (s).
        at: When it was foretold (monotonic, s).
        x: Where the robot will be in ``map`` (m); ``y`` likewise.
        centre_x: Where the zone's centre will be (m); ``centre_y`` likewise.
    """

    zone: Zone
    effect: Effect
    in_s: float
    at: float
    x: float
    y: float
    centre_x: float
    centre_y: float

    def left_s(self, now: Instant) -> float:
        """How soon from now (s)."""
        return max(0.0, self.in_s - (now.mono - self.at))


def probability(in_s: float) -> float:
    """Share (0 to 1) of the encounters foretold so far ahead (s) that came true."""
    return float(np.interp(in_s, *_CAME_TRUE))


Encounters = Mapping[str, Sequence[Encounter]]
"""Robot → the first encounter of each effect with each cause."""
_ByCause = Mapping[str, Encounter]


def by_cause(encounters: Iterable[Encounter], effect: Effect) -> _ByCause:
    """The encounters of one effect, by their cause."""
    return {one.zone.cause: one for one in encounters if one.effect == effect}


class Foresight:
    """Keeps the encounters of the last look."""

    def __init__(self) -> None:
        self._encounters: Encounters = {}
        self._at = -math.inf
        self._steps: LastSteps = {}

    def is_due(self, now: Instant) -> bool:
        """Whether the last look is old."""
        return not 0.0 <= now.mono - self._at < EVERY_S - 1e-6

    def look(
        self,
        world: World,
        people: People,
        rule: DetectionRule,
        now: Instant,
        speeds_before: Mapping[str, float] = MappingProxyType({}),
    ) -> Encounters:
        """The encounters of the fleet, looked for anew every fifth of a second.

        ``speeds_before``: of the robots that are slow now (m/s).
        """
        if self.is_due(now):
            self._at = now.mono
            look = _Look.at(world, people, rule, now, self._steps)
            self._steps = look.steps
            drive = [one for one in world.live_robots() if look.zones and _drives(one)]
            self._encounters = {
                one.robot_id: look.of(one, speeds_before.get(one.robot_id))
                for one in drive
            }
        return self._encounters


def _drives(robot: RobotState) -> bool:
    return robot.odometry is not None and robot.track.motion.speed >= MOVES_M_S


def _is_seen(zone: Zone, now: Instant) -> bool:
    """Whether it is known how its centre goes on.

    Who is seen no more may be anywhere in a zone that grows: where that will be is no
    forecast, and would slow everybody.
    """
    return zone.sighting is None or zone.sighting.age_s(now) <= LIMITS.seen_s


def _row(zone: Zone, world: World, now: Instant) -> tuple[float, ...]:
    """Place (m), velocity (m/s), age (s) and radius (m) of a zone."""
    sighting, radius = zone.sighting, zone.radius_m
    if sighting is None:
        peer = world.robot(zone.cause)
        since, odometry = peer.likely_pose_at(), peer.odometry
        assert odometry is not None  # noqa: S101 - its zone is drawn around its pose
        pose, twist = peer.motion(now).ahead(odometry.pose, odometry.twist)
        age = 0.0 if since is None else max(0.0, now.mono - since)
        goes = twist.linear_x * math.cos(pose.yaw), twist.linear_x * math.sin(pose.yaw)
        return zone.x, zone.y, *goes, age, radius
    age = sighting.age_s(now)
    return zone.x, zone.y, sighting.vx, sighting.vy, age, radius


@dataclass(frozen=True, slots=True)
class LastStep:
    """How a chain of sightings went on last.

    Attributes:
        to: The sighting that it led to.
        vx: In ``map`` (m/s), of a walker at most; ``vy`` likewise.
    """

    to: Sighting
    vx: float
    vy: float


LastSteps = Mapping[int, LastStep]
"""By the number of the chain."""


def last_steps(zones: Iterable[Zone], before: LastSteps) -> LastSteps:
    """The newest step of everybody who has a zone, after those at the look before."""
    newest = (zone.sighting for zone in zones)
    return {
        one.chain: _step(one, before.get(one.chain))
        for one in newest
        if one is not None
    }


def turned(zone: Zone, steps: LastSteps) -> LastStep | None:
    """The newest step of whoever does not go on as before; None: they do."""
    seen = zone.sighting
    step = None if seen is None else steps.get(seen.chain)
    if seen is None or step is None:
        return None
    has_turned = math.hypot(step.vx - seen.vx, step.vy - seen.vy) >= _TURNED_M_S
    return step if has_turned else None


def _step(to: Sighting, before: LastStep | None) -> LastStep:
    """From the step before to a sighting of the same chain."""
    start = to if before is None else before.to
    after_s = to.at.mono - start.at.mono
    if before is not None and after_s < _LEAST_S:
        return before
    if before is None or after_s > LIMITS.seen_s or to.reach_m or start.reach_m:
        return LastStep(to, to.vx, to.vy)
    step = (to.x - start.x) / after_s, (to.y - start.y) / after_s
    return LastStep(to, *of_a_walker(*step))


def _row_of_step(zone: Zone, step: LastStep, now: Instant) -> tuple[float, ...]:
    """The same of somebody who has turned: from where they are taken to be by now."""
    sighting = zone.sighting
    assert sighting is not None  # noqa: S101 - who was not seen made no step
    age = sighting.age_s(now)
    x, y = sighting.x + sighting.vx * age, sighting.y + sighting.vy * age
    return x, y, step.vx, step.vy, 0.0, zone.radius_m


@dataclass(frozen=True, slots=True)
class _Look:
    """One look ahead of the fleet.

    Attributes:
        zones: Those that slow whoever will reach them, then those that are told of.
        slow: How many of them slow.
        steps: How everybody went on last.
    """

    zones: Sequence[Zone]
    slow: int
    moving: MovingZones
    steps: LastSteps
    rule: DetectionRule
    now: Instant

    @classmethod
    def at(
        cls,
        world: World,
        people: People,
        rule: DetectionRule,
        now: Instant,
        before: LastSteps,
    ) -> "_Look":
        """The zones of everybody of whom it is known how they go on.

        ``before``: how they went on at the look before.
        """
        every = list(zones_of(world, people, rule, now))
        slow = [zone for zone in every if _is_seen(zone, now)]
        missed = [
            replace(zone, radius_m=zone.fresh_m)
            for zone in every
            if zone.is_grown and _is_missed(zone, people, now)
        ]
        steps = last_steps(slow, before)
        otherwise = [
            (zone, step)
            for zone in slow
            if not zone.is_grown and (step := turned(zone, steps))
        ]
        moving = MovingZones(
            [_row(zone, world, now) for zone in (*slow, *missed)]
            + [_row_of_step(zone, step, now) for zone, step in otherwise]
        )
        zones = [*slow, *missed, *(zone for zone, _ in otherwise)]
        return cls(zones, len(slow), moving, steps, rule, now)

    def of(self, robot: RobotState, speed_before: float | None) -> Sequence[Encounter]:
        """The encounters of one robot.

        Args:
            robot: One that drives.
            speed_before: Of one that is slow now (m/s).
        """
        slows, tells = self.first(path_of(robot, self.now))
        holds: _ByCause = {}
        would_tell: _ByCause = {}
        if speed_before is not None:
            faster = path_of(robot, self.now, speed_before)
            holds, would_tell = self.first(faster)
        free = _if_free(robot)
        if free is not None:
            is_known = speed_before is not None and free <= _ALIKE * speed_before
            if not is_known:
                _, would_tell = self.first(path_of(robot, self.now, free))
            tells = {**_soon(would_tell), **tells}
        return (
            *slows.values(),
            *(replace(one, effect="holds") for one in holds.values()),
            *(replace(one, effect="tells") for one in tells.values()),
        )

    def first(self, path: Path) -> tuple[_ByCause, _ByCause]:
        """A path's first encounter with each cause in whose zones it does not begin.

        Returns:
            Those that slow, and those to tell: these, and with zones that have not
            grown.
        """
        inside, meetings = self.moving.met_by(path)
        begins_in = [self.zones[one] for one in inside]
        within = {self.zones[one].cause for one in inside if one < self.slow}
        beside = {zone.cause for zone in begins_in if not zone.is_grown}
        slows, tells = dict[str, Encounter](), dict[str, Encounter]()
        for met in (one for one in meetings if self.rule.foresees(one.in_s)):
            zone = self.zones[met.zone]
            if zone.recording is not None:
                continue
            places = met.x, met.y, met.centre_x, met.centre_y
            encounter = Encounter(zone, "slows", met.in_s, self.now.mono, *places)
            if met.zone < self.slow and zone.cause not in within:
                _note(slows, encounter)
            if not zone.is_grown and zone.cause not in beside:
                _note(tells, encounter)
        return slows, tells | slows


def _if_free(robot: RobotState) -> float | None:
    """How fast a slow robot drives once it is let go (m/s); None: it is not slow.

    It reports which share of its speed it allows itself.
    """
    report = robot.safety
    if report is None or report.speed_factor > HALF_SPEED:
        return None
    speed = robot.track.motion.speed / max(report.speed_factor, HALF_SPEED)
    return min(speed, robot.profile.max_speed)


def _soon(encounters: _ByCause) -> _ByCause:
    """Those that a robot would be slow for if it were let go."""
    return {cause: one for cause, one in encounters.items() if one.in_s <= HOLDS_S}


def _is_missed(zone: Zone, people: People, now: Instant) -> bool:
    """Whether somebody may still go on as they did, and only be missed."""
    sighting, person = zone.sighting, people.known.get(zone.cause)
    if sighting is None or person is None or sighting.reach_m:
        return False
    age_s, is_known = sighting.age_s(now), person.is_well_known and not sighting.laser
    return age_s <= (_MISSED_S if is_known else LIMITS.seen_s)


def _note(found: dict[str, Encounter], encounter: Encounter) -> None:
    """Keep the first encounter with each cause."""
    earlier = found.get(encounter.zone.cause)
    if earlier is None or encounter.in_s < earlier.in_s:
        found[encounter.zone.cause] = encounter


def path_of(robot: RobotState, now: Instant, at_least: float = 0.0) -> Path:
    """Where a robot will be in the next three seconds, at least so fast (m/s)."""
    odometry, navigation = robot.odometry, robot.navigation
    assert odometry is not None  # noqa: S101 - only who drives has a path
    since = robot.navigation_received
    is_young = since is not None and now.mono - since.mono <= PLAN_LASTS_S
    plan = navigation.path if navigation is not None and is_young else None
    pose, twist = robot.motion(now).ahead(odometry.pose, odometry.twist)
    return path_ahead(pose, sped_up(twist, at_least), plan)


RANKS: Mapping[str, int] = {
    "waiting": 0,
    "watching": 1,
    "scouting": 1,
    "goal": 2,
    "hauling": 3,
}
"""Tasks by their word (``task`` of a robot's navigation): the greater goes first, a
load before an errand, that before a look around.  Any other word gives no right."""


def gives_way_to(
    robot: RobotState, causes: Collection[str], world: World, now: Instant
) -> frozenset[str]:
    """The peers among these causes whose task is the greater one.

    The paper: "in the absence of human presence, the system manages multi-robot
    interactions by evaluating the task status of detected peers".  The robot with the
    lesser task slows as soon as the encounter is foretold; for the other all stays as
    it is, so nobody is ever faster for it (docs/decisions/0007-right-of-way.md).
    """
    rank = _rank(robot, now)
    if rank is None:
        return frozenset()
    peers = (world.robots[cause] for cause in causes if cause in world.robots)
    theirs = {peer.robot_id: _rank(peer, now) for peer in peers}
    return frozenset(
        peer for peer, other in theirs.items() if other is not None and other > rank
    )


def _rank(robot: RobotState, now: Instant) -> int | None:
    """The rank of a task that was told lately; None: unknown."""
    heard, navigation = robot.navigation_received, robot.navigation
    if navigation is None or heard is None or now.mono - heard.mono > PLAN_LASTS_S:
        return None
    return RANKS.get(navigation.task.strip().lower())
