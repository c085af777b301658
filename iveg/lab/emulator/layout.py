"""Fits a scenario to a fleet and a greenhouse.

In the testbed, AGI and AGII drive their scripts and any other fleet shares one round.
In another greenhouse each robot drives in a lane of its own and people walk beside
it; in an open field each drives a square.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from iveg.adapters.fleet_files import built_in
from iveg.domain.errors import DataFileError
from iveg.domain.fleet import FleetDescription, RobotProfile
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import DriveLane, Greenhouse
from iveg.lab.emulator.scenarios import (
    TESTBED,
    Incident,
    RobotScript,
    Scenario,
    WalkStop,
    route_of,
)

_RING_CORNERS = ((18.0, 2.0), (18.0, 18.0), (2.0, 18.0), (2.0, 2.0))
_END_M, _KEEP_OFF_M = 0.5, 0.9
_FIELD_M, _FIELD_PITCH_M = 12.0, 20.0
_MOST_ON_THE_RING = 20


@dataclass(frozen=True, slots=True)
class Layout:
    """A scenario fitted to one fleet in one greenhouse."""

    robots: Mapping[str, RobotScript]
    profiles: Mapping[str, RobotProfile]
    people: tuple[tuple[WalkStop, ...], ...]
    incidents: tuple[Incident, ...] = ()
    detector: str | None = None


def lay_out(
    scenario: Scenario,
    robots: Sequence[str],
    greenhouse: Greenhouse,
    fleet: FleetDescription | None = None,
) -> Layout:
    """Fit a scenario to a fleet and a greenhouse.

    Args:
        scenario: The scenario.
        robots: Ids of the robots.
        greenhouse: The greenhouse.
        fleet: Fleet description; None: the built-in one.

    Raises:
        DataFileError: the greenhouse has no room for so many robots, or does not fit
            the scenario.
    """
    extra = scenario.incidents, scenario.detector
    profiles = {robot_id: _body(robot_id, fleet or built_in()) for robot_id in robots}
    if scenario.greenhouse not in (TESTBED, greenhouse.name):
        about = f"is about {scenario.greenhouse}, not {greenhouse.name}"
        reason = f"{about}: see IVEG_GREENHOUSE."
        raise DataFileError(f"scenario {scenario.name!r}", "", reason)
    if greenhouse.name == scenario.greenhouse and set(robots) <= set(scenario.robots):
        scripts = {robot_id: scenario.robots[robot_id] for robot_id in robots}
        return Layout(scripts, profiles, scenario.people, *extra)
    if greenhouse.name == TESTBED:
        return Layout(_on_the_ring(robots), profiles, scenario.people, *extra)
    if not greenhouse.lanes:
        people = _around_the_field(robots)
        return Layout(_in_a_field(robots), profiles, people, *extra)
    lanes = _lanes_for(profiles, greenhouse)
    scripts = {
        robot_id: _up_and_down(lane.area, greenhouse)
        for robot_id, lane in zip(robots, lanes, strict=True)
    }
    people = tuple(_beside(lane.area) for lane in lanes[:4])
    return Layout(scripts, profiles, people, *extra)


def _body(robot_id: str, fleet: FleetDescription) -> RobotProfile:
    """Profile of a robot; one without a description is like AGI."""
    one = fleet.of_robot(robot_id)
    return one.profile if one.is_described else built_in().of_robot("AGI").profile


def _on_the_ring(robots: Sequence[str]) -> dict[str, RobotScript]:
    """All robots on one closed route, in one direction, evenly spaced."""
    if len(robots) > _MOST_ON_THE_RING:
        reason = f"has room for {_MOST_ON_THE_RING} robots, not for {len(robots)}."
        raise DataFileError(TESTBED, "", reason)
    route = route_of(_RING_CORNERS, 2.3, True)
    gap = len(route.points) / len(robots)
    return {
        robot_id: RobotScript(
            route.pose_at(int(place * gap)), _RING_CORNERS, 2.3, "patrol", cruise=0.6
        )
        for place, robot_id in enumerate(robots)
    }


def _in_a_field(robots: Sequence[str]) -> dict[str, RobotScript]:
    """One square for each robot."""
    scripts = {}
    for place, robot_id in enumerate(robots):
        x = place * _FIELD_PITCH_M
        corners = (
            (x, 0.0),
            (x + _FIELD_M, 0.0),
            (x + _FIELD_M, _FIELD_M),
            (x, _FIELD_M),
        )
        start = Pose2D(x + 3.0, 0.0, 0.0)
        scripts[robot_id] = RobotScript(start, corners, 2.3, "patrol")
    return scripts


def _around_the_field(robots: Sequence[str]) -> tuple[tuple[WalkStop, ...], ...]:
    return tuple(
        (
            WalkStop(x + 6.0, 1.4, 4.0, 8.0),
            WalkStop(x + 10.6, 6.0, 4.0, 8.0),
            WalkStop(x + 6.0, 10.6, 4.0, 8.0),
        )
        for x in (place * _FIELD_PITCH_M for place in range(min(4, len(robots))))
    )


def _lanes_for(
    robots: Mapping[str, RobotProfile], greenhouse: Greenhouse
) -> list[DriveLane]:
    """One lane for each robot: the one of its start, else the longest free one.

    Robots with the largest turning radius choose first.
    """
    lanes = sorted(greenhouse.lanes, key=lambda lane: -_long(lane.area))
    if len(robots) > len(lanes):
        reason = f"has {len(lanes)} lanes, too few for {len(robots)} robots."
        raise DataFileError(f"greenhouse {greenhouse.name!r}", "", reason)
    chosen: dict[str, DriveLane] = {}
    for robot_id, start in zip(robots, greenhouse.starts, strict=False):
        here = [lane for lane in lanes if lane.area.contains(start.x, start.y)]
        if here:
            chosen[robot_id] = here[0]
            lanes.remove(here[0])
    needy = sorted(robots, key=lambda robot_id: -robots[robot_id].turning_radius)
    for robot_id in needy:
        if robot_id not in chosen:
            chosen[robot_id] = lanes.pop(0)
    return [chosen[robot_id] for robot_id in robots]


def _long(area: Rectangle) -> float:
    return max(area.xmax - area.xmin, area.ymax - area.ymin)


def _ends(area: Rectangle, aside: float) -> tuple[tuple[float, float], ...]:
    """Both ends of a lane, ``aside`` (m) to the right of its middle."""
    inset = 0.7 + _END_M
    if area.xmax - area.xmin >= area.ymax - area.ymin:
        y = (area.ymin + area.ymax) / 2 - aside
        return ((area.xmin + inset, y), (area.xmax - inset, y))
    x = (area.xmin + area.xmax) / 2 + aside
    return ((x, area.ymin + inset), (x, area.ymax - inset))


def _up_and_down(area: Rectangle, greenhouse: Greenhouse) -> RobotScript:
    (ax, ay), (bx, by) = _free_stretch(_ends(area, 0.0), greenhouse)
    start = Pose2D(ax, ay, math.atan2(by - ay, bx - ax))
    return RobotScript(start, ((ax, ay), (bx, by)), 0.0, "patrol", closed=False)


def _free_stretch(
    ends: tuple[tuple[float, float], ...], greenhouse: Greenhouse
) -> tuple[tuple[float, float], tuple[float, float]]:
    """The longest part of a line without crates, trolleys and posts."""
    line = route_of(ends, 0.0, False).points
    best, run = (0, 0), 0
    for index, (x, y) in enumerate(line):
        things = (thing.area for thing in greenhouse.obstacles)
        blocked = any(area.contains(x, y, _KEEP_OFF_M) for area in things) or any(
            math.hypot(post.x - x, post.y - y) < post.radius + _KEEP_OFF_M
            for post in greenhouse.posts
        )
        run = index + 1 if blocked else run
        if index - run > best[1] - best[0]:
            best = (run, index)
    (ax, ay), (bx, by) = line[best[0]], line[best[1]]
    return (float(ax), float(ay)), (float(bx), float(by))


def _beside(area: Rectangle) -> tuple[WalkStop, ...]:
    narrow = min(area.xmax - area.xmin, area.ymax - area.ymin)
    (ax, ay), (bx, by) = _ends(area, max(0.0, narrow / 2 - 0.3))
    middle = WalkStop((ax + bx) / 2, (ay + by) / 2, 3.0, 8.0)
    return (middle, WalkStop(bx, by, 2.0, 6.0), middle, WalkStop(ax, ay, 2.0, 6.0))
