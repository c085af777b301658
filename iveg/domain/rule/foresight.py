"""Encounters before they happen: whose ring each robot will reach, and when.

The paper asks for a "preemptive velocity reduction" if a robot's own path meets the
safety zone of a person.  The path is the robot's own plan where it tells one, else the
arc of its twist; people and peers go on as they were seen to go, so nobody is slowed
for what a person could do at worst.  What is foretold only adds: the ring itself counts
as before (docs/safety.md, "Foresight").
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.fleet import RobotProfile
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.zones import Zone, zones_of
from iveg.domain.tracking.people import People
from iveg.domain.world import World

_Floats = NDArray[np.float64]
HORIZON_S = 3.0
_STEP_S = 0.1
_AHEAD_S: _Floats = np.arange(0.0, HORIZON_S + _STEP_S / 2, _STEP_S)
HOLDS_S = 2.0
"""Who is slow for a ring stays so while it lies so far ahead (s)."""
_EVERY_S = 0.2
"""Encounters are looked for five times a second."""
_MOVES_M_S = 0.05
_REACTION_S = 0.4
"""From here to the robot's brakes (s)."""
_COMFORT = 0.5
"""Of what the brakes can do: nobody has to jump, and no load slides."""
_PLAN_WITHIN_M, _PLAN_LASTS_S = 0.5, 2.5
"""A plan farther from the robot than this, or older, is not what it drives."""
_PLAN_POINTS = 200


@dataclass(frozen=True, slots=True)
class Encounter:
    """A robot will reach a ring.

    Attributes:
        in_s: How soon (s).
    """

    zone: Zone
    in_s: float


Foretold = Mapping[str, Mapping[str, Encounter]]
"""Robot → cause → the first encounter with one of its rings."""


def slows_within_s(profile: RobotProfile, speed: float) -> float:
    """How long a robot takes to halve this speed (m/s) with comfort (s)."""
    return _REACTION_S + abs(speed) * (1 - HALF_SPEED) / (_COMFORT * profile.braking)


class Foresight:
    """Keeps what was foretold last."""

    def __init__(self) -> None:
        self._foretold: Foretold = {}
        self._at = -math.inf

    def look(
        self, world: World, people: People, rule: DetectionRule, now: Instant
    ) -> Foretold:
        """The encounters of the fleet, looked for anew every fifth of a second."""
        if not 0.0 <= now.mono - self._at < _EVERY_S - 1e-6:
            self._at = now.mono
            zones = [z for z in zones_of(world, people, rule, now) if _is_seen(z, now)]
            places = _places(zones, world, now)
            self._foretold = {
                robot.robot_id: _first(robot, zones, places, now)
                for robot in world.live_robots()
                if zones and _drives(robot)
            }
        return self._foretold


def _drives(robot: RobotState) -> bool:
    odometry = robot.odometry
    return odometry is not None and abs(odometry.twist.linear_x) >= _MOVES_M_S


@dataclass(frozen=True, slots=True)
class _Places:
    """Where the centres of rings will be, shape (steps, zones), and their radii."""

    x: _Floats
    y: _Floats
    radius: _Floats


def _is_seen(zone: Zone, now: Instant) -> bool:
    """Whether it is known how its centre goes on.

    Who is seen no more may be anywhere in a ring that grows: where that will be is no
    forecast, and would slow everybody.
    """
    return zone.sighting is None or zone.sighting.age_s(now) <= LIMITS.seen_s


def _places(zones: Sequence[Zone], world: World, now: Instant) -> _Places:
    rows = [_motion(zone, world, now) for zone in zones]
    x, y, vx, vy, age = np.array(rows, np.float64).reshape(-1, 5).T
    goes_on = _AHEAD_S[:, None] + age
    radius = np.array([one.radius_m for one in zones])
    return _Places(x + vx * goes_on, y + vy * goes_on, radius)


def _motion(
    zone: Zone, world: World, now: Instant
) -> tuple[float, float, float, float, float]:
    """Place (m), velocity (m/s) and age (s) of what a ring is drawn around."""
    sighting = zone.sighting
    if sighting is None:
        peer = world.robot(zone.cause)
        since, odometry = peer.likely_pose_at(), peer.odometry
        assert odometry is not None  # noqa: S101 - its ring is drawn around its pose
        speed, yaw = odometry.twist.linear_x, odometry.pose.yaw
        age = 0.0 if since is None else max(0.0, now.mono - since)
        return zone.x, zone.y, speed * math.cos(yaw), speed * math.sin(yaw), age
    return zone.x, zone.y, sighting.vx, sighting.vy, sighting.age_s(now)


def _first(
    robot: RobotState, zones: Sequence[Zone], places: _Places, now: Instant
) -> Mapping[str, Encounter]:
    """The first encounter of a robot with each cause in whose rings it is not yet."""
    x, y = path_of(robot, now)
    apart = np.hypot(places.x - x[:, None], places.y - y[:, None]) - places.radius
    inside = apart <= 0.0
    with_it = {zones[one].cause for one in np.flatnonzero(inside[0]).tolist()}
    found: dict[str, Encounter] = {}
    for column in np.flatnonzero(inside.any(0)).tolist():
        zone = zones[column]
        if zone.cause in with_it or zone.recording is not None:
            continue
        in_s = _crossed_at(apart[:, column], int(inside[:, column].argmax()))
        earlier = found.get(zone.cause)
        if earlier is None or in_s < earlier.in_s:
            found[zone.cause] = Encounter(zone, in_s)
    return found


def _crossed_at(apart: _Floats, step: int) -> float:
    """When a distance that is at most 0 from a step on becomes so (s)."""
    before, after = float(apart[step - 1]), float(apart[step])
    return float(_AHEAD_S[step - 1]) + _STEP_S * before / (before - after)


def path_of(robot: RobotState, now: Instant) -> tuple[_Floats, _Floats]:
    """Where a robot will be in the next three seconds: x and y, shape (steps,) (m)."""
    odometry = robot.odometry
    assert odometry is not None  # noqa: S101 - only who drives has a path
    planned = _along_plan(robot, now)
    if planned is not None:
        return planned
    pose, twist = odometry.pose, odometry.twist
    turned = pose.yaw + twist.angular_z * _AHEAD_S
    if abs(twist.angular_z) < 1e-3:
        way = twist.linear_x * _AHEAD_S
        return pose.x + way * math.cos(pose.yaw), pose.y + way * math.sin(pose.yaw)
    radius = twist.linear_x / twist.angular_z
    x: _Floats = pose.x + radius * (np.sin(turned) - math.sin(pose.yaw))
    y: _Floats = pose.y - radius * (np.cos(turned) - math.cos(pose.yaw))
    return x, y


def _along_plan(robot: RobotState, now: Instant) -> tuple[_Floats, _Floats] | None:
    """The robot's own plan at its present speed; None where it is not driving it."""
    navigation, since, odometry = (
        robot.navigation,
        robot.navigation_received,
        robot.odometry,
    )
    if navigation is None or since is None or odometry is None:
        return None
    if now.mono - since.mono > _PLAN_LASTS_S or odometry.twist.linear_x < 0.0:
        return None
    points = np.array(navigation.path[:_PLAN_POINTS], np.float64).reshape(-1, 2)
    if len(points) < 2:
        return None
    pose, speed = odometry.pose, odometry.twist.linear_x
    starts, legs = points[:-1], np.diff(points, axis=0)
    lengths = np.hypot(*legs.T)
    to = np.array((pose.x, pose.y)) - starts
    share = np.einsum("ij,ij->i", to, legs) / np.maximum(lengths, 1e-9) ** 2
    feet = starts + np.clip(share, 0.0, 1.0)[:, None] * legs
    off = np.hypot(feet[:, 0] - pose.x, feet[:, 1] - pose.y)
    nearest = int(off.argmin())
    if off[nearest] > _PLAN_WITHIN_M:
        return None
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    here = along[nearest] + min(max(float(share[nearest]), 0.0), 1.0) * lengths[nearest]
    ways = here + speed * _AHEAD_S
    x: _Floats = np.interp(ways, along, points[:, 0])
    y: _Floats = np.interp(ways, along, points[:, 1])
    return x, y
