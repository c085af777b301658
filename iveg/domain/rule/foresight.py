"""Encounters before they happen: zones that each robot will reach, and when.

The paper asks for a "preemptive velocity reduction" if a robot's own path meets the
safety zone of a person.  The path is the robot's own plan where it publishes one, else
the arc of its twist.  People and peers keep the velocity that was seen, so nobody is
slowed for what a person could do at worst.  An encounter only adds: the zone itself
counts as before (docs/safety.md, "Foresight").
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.paths import (
    MOVES_M_S,
    PLAN_LASTS_S,
    MovingZone,
    MovingZones,
    Path,
    path_ahead,
    sped_up,
)
from iveg.domain.rule.zones import Zone
from iveg.domain.world import World

_CAME_TRUE = ((0.5, 1.0, 1.5, 2.0, 2.5, 3.0), (0.97, 0.96, 0.93, 0.87, 0.86, 0.89))
"""Time ahead (s), and the share of forecasts that came true (docs/experiment.md)."""


@dataclass(frozen=True, slots=True)
class Encounter:
    """A robot will reach a zone.

    Attributes:
        effect: ``slows``: on the present path; the robot slows when only its braking
            time is left.  ``holds``: at its speed before it slowed; its limit for this
            cause stays.
        in_s: Time to the encounter, counted from ``at`` (s).
        at: Moment of the forecast (monotonic, s).
        x: Place of the robot then, in ``map`` (m); ``y`` likewise.
        centre_x: Place of the zone's centre then (m); ``centre_y`` likewise.
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
    """Share (0 to 1) of forecasts this far ahead (s) that came true."""
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
    """Encounters of the fleet, forecast now.

    Args:
        world: Its robots.
        zones: Zones of people and peers; those of recordings get no forecast.
        rule: The rule, with its horizon.
        now: This moment.
        speeds_before: Speed of each slow robot before it slowed (m/s).
    """
    # A forecast from the centre of a grown zone would be a guess, and slow every robot.
    known = [zone for zone in zones if not zone.is_grown and zone.recording is None]
    forecaster = _Forecaster(
        known, MovingZones([_moving(zone, world, now) for zone in known]), rule
    )
    return {
        robot.robot_id: forecaster.encounters_of(
            robot, speeds_before.get(robot.robot_id), now
        )
        for robot in world.live_robots()
        if known and robot.odometry and robot.track.motion.speed >= MOVES_M_S
    }


def _moving(zone: Zone, world: World, now: Instant) -> MovingZone:
    """A zone with the velocity of the person or peer in it."""
    sighting, radius = zone.sighting, zone.radius_m
    if sighting is None:
        peer = world.robot(zone.cause)
        since, odometry = peer.likely_pose_at(), peer.odometry
        assert odometry is not None  # noqa: S101 - its zone is drawn around its pose
        pose, twist = peer.motion(now).ahead(odometry.pose, odometry.twist)
        age = 0.0 if since is None else max(0.0, now.mono - since)
        vx, vy = (
            twist.linear_x * math.cos(pose.yaw),
            twist.linear_x * math.sin(pose.yaw),
        )
        return MovingZone(zone.x, zone.y, vx, vy, age, radius)
    age = sighting.age_s(now)
    return MovingZone(zone.x, zone.y, sighting.vx, sighting.vy, age, radius)


@dataclass(frozen=True, slots=True)
class _Forecaster:
    """Zones with known motion, and the rule for forecasts."""

    zones: Sequence[Zone]
    moving: MovingZones
    rule: DetectionRule

    def encounters_of(
        self, robot: RobotState, speed_before: float | None, now: Instant
    ) -> Mapping[str, Encounter]:
        """First encounter of a robot with each cause."""
        encounters = self._encounters_on(path_of(robot, now), "slows", now)
        if speed_before is not None:
            faster = path_of(robot, now, speed_before)
            # An encounter on the present path goes before one at the earlier speed.
            encounters = {**self._encounters_on(faster, "holds", now), **encounters}
        return encounters

    def _encounters_on(
        self, path: Path, effect: Literal["slows", "holds"], now: Instant
    ) -> dict[str, Encounter]:
        """First encounter of a path with each cause, except zones that it begins in."""
        inside, meetings = self.moving.met_by(path)
        within = {self.zones[number].cause for number in inside}
        encounters = dict[str, Encounter]()
        for meeting in sorted(meetings, key=lambda meeting: meeting.in_s):
            zone = self.zones[meeting.zone]
            if zone.cause not in within and self.rule.foresees(meeting.in_s):
                places = meeting.x, meeting.y, meeting.centre_x, meeting.centre_y
                first = Encounter(zone, effect, meeting.in_s, now.mono, *places)
                encounters.setdefault(zone.cause, first)
        return encounters


def path_of(robot: RobotState, now: Instant, at_least: float = 0.0) -> Path:
    """Path of a robot in the next three seconds, at ``at_least`` (m/s) or faster."""
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
"""Rank of each task (``task`` of a robot's navigation); the greater rank goes first: a
load before an errand, an errand before a look around.  Another word has no rank."""


def gives_way_to(
    robot: RobotState, zones: Sequence[Zone], world: World, now: Instant
) -> frozenset[str]:
    """Peers among the causes of these zones whose task has the greater rank.

    The paper: "in the absence of human presence, the system manages multi-robot
    interactions by evaluating the task status of detected peers".  The robot of
    lesser rank slows as soon as the encounter is forecast.  The other robot drives
    on, so right of way makes no robot faster (docs/decisions/0007-right-of-way.md).
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
    """Rank of a robot's task; None: the word is unknown, or no task came lately."""
    since, navigation = robot.navigation_received, robot.navigation
    if navigation is None or since is None or now.mono - since.mono > PLAN_LASTS_S:
        return None
    return RANKS.get(navigation.task.strip().lower())
