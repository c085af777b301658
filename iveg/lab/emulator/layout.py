"""Fits a scenario to a fleet and a greenhouse.

In the testbed, AGI and AGII drive their scripts and any other fleet shares one round.
In another greenhouse each robot drives in a lane of its own and people walk beside it;
an open field is treated as lanes beside each other.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from iveg.adapters.fleet_files import built_in
from iveg.domain.errors import DataFileError
from iveg.domain.fleet import FleetDescription, RobotProfile
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.lab.emulator.greenhouse import Floats
from iveg.lab.emulator.scenarios import (
    TESTBED,
    RobotScript,
    Scenario,
    WalkStop,
    route_of,
)

_ROUND_CORNERS = ((18.0, 2.0), (18.0, 18.0), (2.0, 18.0), (2.0, 2.0))
_MOST_ON_THE_ROUND = 20
_END_M, _KEEP_OFF_M = 0.5, 0.9
_FIELD_LENGTH_M, _FIELD_WIDTH_M, _FIELD_PITCH_M = 25.0, 3.0, 20.0
_MOST_PEOPLE = 4


@dataclass(frozen=True, slots=True)
class Layout:
    """A scenario fitted to one fleet in one greenhouse."""

    robots: Mapping[str, RobotScript]
    profiles: Mapping[str, RobotProfile]
    people: tuple[tuple[WalkStop, ...], ...]


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
    profiles = {robot_id: _body(robot_id, fleet or built_in()) for robot_id in robots}
    if scenario.greenhouse not in (TESTBED, greenhouse.name):
        about = f"is about {scenario.greenhouse}, not {greenhouse.name}"
        reason = f"{about}: see IVEG_GREENHOUSE."
        raise DataFileError(f"scenario {scenario.name!r}", "", reason)
    if greenhouse.name == scenario.greenhouse and set(robots) <= set(scenario.robots):
        scripts = {robot_id: scenario.robots[robot_id] for robot_id in robots}
        return Layout(scripts, profiles, scenario.people)
    if greenhouse.name == TESTBED:
        return Layout(_on_the_round(robots), profiles, scenario.people)
    lanes = _lanes_for(robots, greenhouse)
    scripts = {
        robot_id: _up_and_down(lane, greenhouse)
        for robot_id, lane in zip(robots, lanes, strict=True)
    }
    people = tuple(_beside(lane) for lane in lanes[:_MOST_PEOPLE])
    return Layout(scripts, profiles, people)


def _body(robot_id: str, fleet: FleetDescription) -> RobotProfile:
    """Profile of a robot; one without a description is like AGI."""
    member = fleet.of_robot(robot_id)
    return member.profile if member.is_described else built_in().of_robot("AGI").profile


def _on_the_round(robots: Sequence[str]) -> dict[str, RobotScript]:
    """All robots on one closed route, in one direction, evenly spaced."""
    if len(robots) > _MOST_ON_THE_ROUND:
        reason = f"has room for {_MOST_ON_THE_ROUND} robots, not for {len(robots)}."
        raise DataFileError(TESTBED, "", reason)
    route = route_of(_ROUND_CORNERS, 2.3, True)
    spacing = len(route.points) / len(robots)
    return {
        robot_id: RobotScript(
            route.pose_at(int(place * spacing)),
            _ROUND_CORNERS,
            2.3,
            "patrol",
            cruise=0.6,
        )
        for place, robot_id in enumerate(robots)
    }


def _lanes_for(robots: Sequence[str], greenhouse: Greenhouse) -> list[Rectangle]:
    """A lane for each robot: the lane of its start, else the longest free lane.

    In an open field the lanes lie beside each other.
    """
    if not greenhouse.lanes:
        starts = [place * _FIELD_PITCH_M for place in range(len(robots))]
        return [Rectangle(x, 0.0, x + _FIELD_WIDTH_M, _FIELD_LENGTH_M) for x in starts]
    lanes = sorted(
        (lane.area for lane in greenhouse.lanes),
        key=lambda area: max(area.xmax - area.xmin, area.ymax - area.ymin),
        reverse=True,
    )
    if len(robots) > len(lanes):
        reason = f"has {len(lanes)} lanes, too few for {len(robots)} robots."
        raise DataFileError(f"greenhouse {greenhouse.name!r}", "", reason)
    chosen_lanes = []
    for start in greenhouse.starts[: len(robots)]:
        here = [area for area in lanes if area.contains(start.x, start.y)]
        chosen_lanes.append((here or lanes)[0])
        lanes.remove(chosen_lanes[-1])
    return [*chosen_lanes, *lanes][: len(robots)]


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

    def is_free(point: Floats) -> bool:
        x, y = point
        return not any(
            thing.area.contains(x, y, _KEEP_OFF_M) for thing in greenhouse.obstacles
        ) and all(
            math.dist((post.x, post.y), (x, y)) >= post.radius + _KEEP_OFF_M
            for post in greenhouse.posts
        )

    line = groupby(route_of(ends, 0.0, False).points, is_free)
    longest = max((list(points) for free, points in line if free), key=len)
    (ax, ay), (bx, by) = longest[0], longest[-1]
    return (float(ax), float(ay)), (float(bx), float(by))


def _beside(area: Rectangle) -> tuple[WalkStop, ...]:
    narrow = min(area.xmax - area.xmin, area.ymax - area.ymin)
    (ax, ay), (bx, by) = _ends(area, max(0.0, narrow / 2 - 0.3))
    middle = WalkStop((ax + bx) / 2, (ay + by) / 2, 3.0, 8.0)
    return (middle, WalkStop(bx, by, 2.0, 6.0), middle, WalkStop(ax, ay, 2.0, 6.0))
