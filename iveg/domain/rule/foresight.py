"""Encounters before they happen: whose ring each robot will reach, and when.

The paper asks for a "preemptive velocity reduction" if a robot's own path meets the
safety zone of a person.  The path is the robot's own plan where it tells one, else the
arc of its twist; people and peers go on as they were seen to go, so nobody is slowed
for what a person could do at worst.  What is foretold only adds: the ring itself counts
as before (docs/safety.md, "Foresight").  More is told than slows: a robot that is slow
already, for a ring that grows while somebody is out of sight or for something else,
still has the encounter before it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.last_steps import LastStep, LastSteps, last_steps, turned
from iveg.domain.rule.paths import (
    EVERY_S,
    HOLDS_S,
    MOVES_M_S,
    PLAN_LASTS_S,
    Circles,
    Path,
    path_ahead,
    sped_up,
)
from iveg.domain.rule.zones import Zone, zones_of
from iveg.domain.tracking.people import People
from iveg.domain.world import World

_CAME_TRUE = ((0.5, 1.0, 1.5, 2.0, 2.5, 3.0), (0.98, 0.93, 0.92, 0.88, 0.83, 0.78))
"""Measured (``benchmarks.foresight``; docs/experiment.md, "Foresight")."""
_ALIKE = 1.05
"""By so much faster makes no other forecast."""
_MISSED_S = 2.0
"""So long a detector may miss somebody who is there (s)."""


@dataclass(frozen=True, slots=True)
class Encounter:
    """A robot will reach a ring.

    Attributes:
        in_s: How soon, counted from ``at`` (s).
        at: When it was foretold (monotonic, s).
        x: Where the robot will be in ``map`` (m); ``y`` likewise.
        centre_x: Where the ring's centre will be (m); ``centre_y`` likewise.
    """

    zone: Zone
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


Foretold = Mapping[str, Mapping[str, Encounter]]
"""Robot → cause → the first encounter with one of its rings."""
_Ahead = Mapping[str, Encounter]
"""The same of one robot."""


class Foresight:
    """Keeps what was foretold last.

    Attributes:
        shown: For people to see: what slows, who is out of sight for a moment, who is
            met if they go on as in their newest step, and whom a robot that is slow
            would meet as soon as it is let go.
        if_released: What would be foretold of slowed robots at the speed that they had
            before: who would have to slow again at once is better not let go.
    """

    def __init__(self) -> None:
        self._foretold: Foretold = {}
        self.shown: dict[str, _Ahead] = {}
        self.if_released: Foretold = {}
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
    ) -> Foretold:
        """The encounters of the fleet, looked for anew every fifth of a second.

        ``speeds_before``: of the robots that are slow now (m/s).
        """
        if self.is_due(now):
            self._at = now.mono
            look = _Look.at(world, people, rule, now, self._steps)
            self._steps = look.steps
            drive = [one for one in world.live_robots() if look.zones and _drives(one)]
            ahead = {one.robot_id: look.first(path_of(one, now)) for one in drive}
            again = {
                one.robot_id: look.first(path_of(one, now, speed))
                for one in drive
                if (speed := speeds_before.get(one.robot_id)) is not None
            }
            self._foretold = {name: slows for name, (slows, _) in ahead.items()}
            self.if_released = {name: slows for name, (slows, _) in again.items()}
            self.shown = {name: {**shown} for name, (_, shown) in ahead.items()}
            for one in drive:
                name, free = one.robot_id, _if_free(one)
                if free is None:
                    continue
                known = name in again and free <= _ALIKE * speeds_before[name]
                met = again[name] if known else look.first(path_of(one, now, free))
                self.shown[name] = {**_soon(met[1]), **self.shown[name]}
        return self._foretold


def _drives(robot: RobotState) -> bool:
    odometry = robot.odometry
    return odometry is not None and abs(odometry.twist.linear_x) >= MOVES_M_S


def _is_seen(zone: Zone, now: Instant) -> bool:
    """Whether it is known how its centre goes on.

    Who is seen no more may be anywhere in a ring that grows: where that will be is no
    forecast, and would slow everybody.
    """
    return zone.sighting is None or zone.sighting.age_s(now) <= LIMITS.seen_s


def _circle(zone: Zone, world: World, now: Instant) -> tuple[float, ...]:
    """Place (m), velocity (m/s), age (s) and radius (m) of a ring."""
    sighting, radius = zone.sighting, zone.radius_m
    if sighting is None:
        peer = world.robot(zone.cause)
        since, odometry = peer.likely_pose_at(), peer.odometry
        assert odometry is not None  # noqa: S101 - its ring is drawn around its pose
        speed, yaw = odometry.twist.linear_x, odometry.pose.yaw
        age = 0.0 if since is None else max(0.0, now.mono - since)
        goes = speed * math.cos(yaw), speed * math.sin(yaw)
        return zone.x, zone.y, *goes, age, radius
    age = sighting.age_s(now)
    return zone.x, zone.y, sighting.vx, sighting.vy, age, radius


def _circle_of(zone: Zone, step: LastStep, now: Instant) -> tuple[float, ...]:
    """The same of who has turned: from where they are taken to be by now."""
    sighting = zone.sighting
    assert sighting is not None  # noqa: S101 - who was not seen made no step
    age = sighting.age_s(now)
    x, y = sighting.x + sighting.vx * age, sighting.y + sighting.vy * age
    return x, y, step.vx, step.vy, 0.0, zone.radius_m


@dataclass(frozen=True, slots=True)
class _Look:
    """One look ahead of the fleet.

    Attributes:
        zones: The rings that slow whoever will reach them, then those that are told of.
        slow: How many of them slow.
        steps: How everybody went on last.
    """

    zones: Sequence[Zone]
    slow: int
    circles: Circles
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
        """The rings of everybody of whom it is known how they go on.

        ``before``: how they went on at the look before.
        """
        every = list(zones_of(world, people, rule, now))
        slow = [zone for zone in every if _is_seen(zone, now)]
        missed = [
            replace(zone, radius_m=rule.radius_m)
            for zone in every
            if zone.radius_m > rule.radius_m and _is_missed(zone, people, now)
        ]
        steps = last_steps(slow, before)
        otherwise = [
            (zone, step)
            for zone in slow
            if zone.radius_m <= rule.radius_m and (step := turned(zone, steps))
        ]
        circles = Circles(
            [_circle(zone, world, now) for zone in (*slow, *missed)]
            + [_circle_of(zone, step, now) for zone, step in otherwise]
        )
        zones = [*slow, *missed, *(zone for zone, _ in otherwise)]
        return cls(zones, len(slow), circles, steps, rule, now)

    def first(self, path: Path) -> tuple[_Ahead, _Ahead]:
        """A path's first encounter with each cause in whose rings it does not begin.

        Returns:
            Those that slow, and those to tell: these, and with rings that have not
            grown.
        """
        inside, meetings = self.circles.met_by(path)
        begins_in, ring_m = [self.zones[one] for one in inside], self.rule.radius_m
        within = {self.zones[one].cause for one in inside if one < self.slow}
        beside = {zone.cause for zone in begins_in if zone.radius_m <= ring_m}
        slows, shown = dict[str, Encounter](), dict[str, Encounter]()
        for met in (one for one in meetings if self.rule.foresees(one.in_s)):
            zone = self.zones[met.circle]
            if zone.recording is not None:
                continue
            places = met.x, met.y, met.centre_x, met.centre_y
            encounter = Encounter(zone, met.in_s, self.now.mono, *places)
            if met.circle < self.slow and zone.cause not in within:
                _note(slows, encounter)
            if zone.radius_m <= ring_m and zone.cause not in beside:
                _note(shown, encounter)
        return slows, shown | slows


def _if_free(robot: RobotState) -> float | None:
    """How fast a slow robot drives once it is let go (m/s); None: it is not slow.

    It reports which share of its speed it allows itself.
    """
    report, odometry = robot.safety, robot.odometry
    if report is None or odometry is None or report.speed_factor > HALF_SPEED:
        return None
    speed = abs(odometry.twist.linear_x) / max(report.speed_factor, HALF_SPEED)
    return min(speed, robot.profile.max_speed)


def _soon(again: _Ahead) -> _Ahead:
    """Whom a robot would be slow for if it were let go."""
    return {cause: one for cause, one in again.items() if one.in_s <= HOLDS_S}


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
    return path_ahead(odometry.pose, sped_up(odometry.twist, at_least), plan)
