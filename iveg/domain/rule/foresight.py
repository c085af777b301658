"""Encounters before they happen: whose zone each robot will reach, and when.

The paper asks for a "preemptive velocity reduction" if a robot's own path meets the
safety zone of a person.  The path is the robot's own plan where it tells one, else the
arc of its twist; people and peers go on as they were seen to go, so nobody is slowed
for what a person could do at worst.  An encounter only adds: the zone itself counts as
before (docs/safety.md, "Foresight").
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.paths import (
    MOVES_M_S,
    PLAN_LASTS_S,
    MovingZones,
    Path,
    path_ahead,
    sped_up,
)
from iveg.domain.rule.zones import Zone
from iveg.domain.world import World

_CAME_TRUE = ((0.5, 1.0, 1.5, 2.0, 2.5, 3.0), (0.98, 0.93, 0.92, 0.88, 0.83, 0.78))
"""Measured (``benchmarks.foresight``; docs/experiment.md, "Foresight")."""


@dataclass(frozen=True, slots=True)
class Encounter:
    """A robot will reach a zone.

    Attributes:
        effect: ``slows``: on its present path, from the braking time on; ``holds``: a
            slow robot would at the speed of before, so it is not let go that is slow
            for this cause already.
        in_s: How soon, counted from ``at`` (s).
        at: When it was foretold (monotonic, s).
        x: Where the robot will be in ``map`` (m); ``y`` likewise.
        centre_x: Where the zone's centre will be (m); ``centre_y`` likewise.
    """

    zone: Zone
    effect: Literal["slows", "holds"]
    in_s: float
    at: float
    x: float
    y: float
    centre_x: float
    centre_y: float

    def left_s(self, now: Instant) -> float:
        """Time left from now (s)."""
        return max(0.0, self.in_s - (now.mono - self.at))


def probability(in_s: float) -> float:
    """Share (0 to 1) of the encounters foretold so far ahead (s) that came true."""
    return float(np.interp(in_s, *_CAME_TRUE))


Encounters = Mapping[str, Mapping[str, Encounter]]
"""Robot → cause → its first encounter."""


def look_ahead(
    world: World,
    zones: Iterable[Zone],
    rule: DetectionRule,
    now: Instant,
    speeds_before: Mapping[str, float],
) -> Encounters:
    """The encounters of the fleet now.

    Args:
        world: Its robots.
        zones: Of people and peers; recordings slow nobody before they are there.
        rule: How far ahead to look.
        now: This moment.
        speeds_before: Of the robots that are slow, before that (m/s).
    """
    known = [one for one in zones if _goes_on_as_seen(one, now)]
    ahead = _Ahead(known, MovingZones([_row(one, world, now) for one in known]), rule)
    return {
        robot.robot_id: ahead.encounters_of(
            robot, speeds_before.get(robot.robot_id), now
        )
        for robot in world.live_robots()
        if known and robot.odometry and robot.track.motion.speed >= MOVES_M_S
    }


def _goes_on_as_seen(zone: Zone, now: Instant) -> bool:
    """Whether it is known how a zone's centre goes on.

    Somebody out of sight may be anywhere in a zone that grows: where that will be is no
    forecast, and would slow everybody.
    """
    is_seen = zone.sighting is None or zone.sighting.age_s(now) <= LIMITS.seen_s
    return is_seen and zone.recording is None


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
class _Ahead:
    """Zones of which it is known how they go on."""

    zones: Sequence[Zone]
    moving: MovingZones
    rule: DetectionRule

    def encounters_of(
        self, robot: RobotState, speed_before: float | None, now: Instant
    ) -> Mapping[str, Encounter]:
        """The first encounter of a robot with each cause."""
        found = self._met_on(path_of(robot, now), "slows", now)
        if speed_before is not None:
            faster = path_of(robot, now, speed_before)
            found = {**self._met_on(faster, "holds", now), **found}
        return found

    def _met_on(
        self, path: Path, effect: Literal["slows", "holds"], now: Instant
    ) -> dict[str, Encounter]:
        """A path's first encounter with each cause in whose zones it does not begin."""
        inside, meetings = self.moving.met_by(path)
        within = {self.zones[number].cause for number in inside}
        found = dict[str, Encounter]()
        for met in sorted(meetings, key=lambda one: one.in_s):
            zone = self.zones[met.zone]
            if zone.cause not in within and self.rule.foresees(met.in_s):
                places = met.x, met.y, met.centre_x, met.centre_y
                first = Encounter(zone, effect, met.in_s, now.mono, *places)
                found.setdefault(zone.cause, first)
        return found


def path_of(robot: RobotState, now: Instant, at_least: float = 0.0) -> Path:
    """Where a robot will be in the next three seconds, at least so fast (m/s)."""
    odometry, navigation = robot.odometry, robot.navigation
    assert odometry is not None  # noqa: S101 - only a robot that drives has a path
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
    robot: RobotState, zones: Sequence[Zone], world: World, now: Instant
) -> frozenset[str]:
    """The peers among the causes of these zones whose task is the greater one.

    The paper: "in the absence of human presence, the system manages multi-robot
    interactions by evaluating the task status of detected peers".  The robot with the
    lesser task slows as soon as the encounter is foretold; for the other all stays as
    it is, so nobody is ever faster for it (docs/decisions/0007-right-of-way.md).
    """
    rank = _rank(robot, now)
    if rank is None or any(zone.reason == "person" for zone in zones):
        return frozenset()
    peers = {zone.cause for zone in zones} & world.robots.keys()
    theirs = {peer: _rank(world.robots[peer], now) for peer in peers}
    return frozenset(
        peer for peer, other in theirs.items() if other is not None and other > rank
    )


def _rank(robot: RobotState, now: Instant) -> int | None:
    """The rank of a task that was told lately; None: unknown."""
    heard, navigation = robot.navigation_received, robot.navigation
    if navigation is None or heard is None or now.mono - heard.mono > PLAN_LASTS_S:
        return None
    return RANKS.get(navigation.task.strip().lower())
