"""People in a robot's costmap whom its own sensors could not see."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from iveg.domain.costmap import InflatedGrid
from iveg.domain.occupancy_grid import Grid
from iveg.domain.records import Json
from iveg.lab.experiment.scoring import Picture, SeenObject

Held = Literal["nobody", "told", "own"]
Belief = Callable[[float, float], Held]
"""Content of a position in ``map`` (m), and whether peers reported it."""
_TAKEN: Final = 50
"""Least cost of an occupied cell of the costmap (0 to 100)."""
_SAME_MOMENT_S: Final = 0.1


def belief_of(own: InflatedGrid, with_peers: InflatedGrid) -> Belief:
    """Belief of the robot's own scan and of the costmap with peer reports."""

    def held(x: float, y: float) -> Held:
        if _is_taken(own, x, y):
            return "own"
        return "told" if _is_taken(with_peers, x, y) else "nobody"

    return held


def belief_in(answer: Json) -> Belief:
    """Belief of an API response, which combines both."""
    width, height, origin = answer["width"], answer["height"], answer["origin"]
    grid = Grid(answer["resolution"], origin["x"], origin["y"], width, height)
    cells = np.asarray(answer["data"], np.int8).reshape(height, width)
    costmap = InflatedGrid(grid, cells)
    return lambda x, y: "told" if _is_taken(costmap, x, y) else "nobody"


@dataclass(frozen=True, slots=True)
class InjectionQuestion:
    """A person whom others had in view and a robot's camera had not, and its costmap.

    Attributes:
        at: Moment (s, by the clock of the pictures).
        key: The person; ``x``, ``y`` their true place in ``map`` (m).
        held: What the costmap held there.
        first: Whether the robot's camera had not had them before.
    """

    at: float
    key: str
    x: float
    y: float
    held: Held
    first: bool


def questions(
    truth: Sequence[Picture], beliefs: Iterable[tuple[float, Belief]], robot_id: str
) -> Iterator[InjectionQuestion]:
    """Every person out of the robot's sight at every moment of its costmap."""
    sighted = _first_sights(truth, robot_id)
    for at, belief in beliefs:
        for one in _hidden(truth, at, robot_id):
            is_first = sighted.get(one.key, float("inf")) > at
            held = belief(one.x, one.y)
            yield InjectionQuestion(at, one.key, one.x, one.y, held, is_first)


def injections(asked: Sequence[InjectionQuestion]) -> dict[str, int]:
    """How often the costmap contained a person whom the robot could not see.

    ``asked``: moments at which another robot had a person in view and this robot's
    camera and laser had not; ``injected``: those in which its costmap contained the
    person.  ``people``: people whom another robot had in view first; ``ahead``: those
    in the costmap before its own camera had them.
    """
    return {
        "asked": sum(one.held != "own" for one in asked),
        "injected": sum(one.held == "told" for one in asked),
        "people": len({one.key for one in asked if one.first}),
        "ahead": len({one.key for one in asked if one.first and one.held == "told"}),
    }


def _hidden(truth: Sequence[Picture], at: float, robot_id: str) -> list[SeenObject]:
    """People whom others have in view at a moment, but not this robot's camera."""
    near = [one for one in truth if abs(one.at - at) < _SAME_MOMENT_S]
    own = {s.key for one in near if one.robot_id == robot_id for s in one.seen}
    others = (s for one in near if one.robot_id != robot_id for s in one.seen)
    hidden = {s.key: s for s in others if s.class_id == "farmer" and s.key not in own}
    return list(hidden.values())


def _first_sights(truth: Sequence[Picture], robot_id: str) -> dict[str, float]:
    """Time at which a robot's own camera first had each target in view (s)."""
    first: dict[str, float] = {}
    for picture in truth:
        if picture.robot_id == robot_id:
            for one in picture.seen:
                first[one.key] = min(picture.at, first.get(one.key, picture.at))
    return first


def _is_taken(costmap: InflatedGrid, x: float, y: float) -> bool:
    grid = costmap.grid
    column = math.floor((x - grid.xmin) / grid.resolution)
    row = math.floor((y - grid.ymin) / grid.resolution)
    if not (0 <= column < grid.width and 0 <= row < grid.height):
        return False
    return int(costmap.data[row, column]) >= _TAKEN
