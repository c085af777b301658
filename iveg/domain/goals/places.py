"""Where a goal may be: in the greenhouse, and in no plant, post or crate."""

from collections.abc import Iterator
from dataclasses import dataclass

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.goals.orders import GoalKind
from iveg.domain.greenhouse import Greenhouse

_STEP_M = 0.25


@dataclass(frozen=True, slots=True)
class GoalWish:
    """What a person asked for.

    Attributes:
        x: Of ``here``, in ``map`` (m); ``y`` too.
        aisle: Label of a lane, for ``aisle``.
    """

    kind: GoalKind
    x: float = 0.0
    y: float = 0.0
    aisle: str | None = None


def place_of(
    wish: GoalWish,
    greenhouse: Greenhouse,
    profile: RobotProfile,
    pose: Pose2D,
    start: Pose2D | None,
) -> tuple[float, float] | str:
    """The place that is meant (m), or the code of what is wrong with it.

    Args:
        wish: The wish.
        greenhouse: What stands there.
        profile: Body of the robot: half its width must be free about the place.
        pose: Where the robot is.
        start: Where it belongs; None where nobody knows.
    """
    keep_off_m = profile.width / 2
    match wish.kind:
        case "pause":
            return pose.x, pose.y
        case "return":
            place = None if start is None else (start.x, start.y)
        case "aisle":
            lanes = (one for one in greenhouse.lanes if one.label == wish.aisle)
            lane = next(lanes, None)
            if lane is None:
                return "no_such_aisle"
            free = (
                one
                for one in _from_the_middle(lane.area)
                if _obstructed(greenhouse, *one, keep_off_m) is None
            )
            place = next(free, None)
        case "here":
            place = wish.x, wish.y
    if place is None:
        return "no_start" if wish.kind == "return" else "obstacle"
    return _obstructed(greenhouse, *place, keep_off_m) or place


def _obstructed(
    greenhouse: Greenhouse, x: float, y: float, keep_off_m: float
) -> str | None:
    """Code of what stands at a place; None where a robot fits."""
    if not greenhouse.bounds.contains(x, y, -keep_off_m):
        return "outside"
    if any(row.contains(x, y, keep_off_m) for row in greenhouse.rows):
        return "in_plants"
    things = any(one.area.contains(x, y, keep_off_m) for one in greenhouse.obstacles)
    posts = any(
        Pose2D(one.x, one.y, 0.0).distance_to(x, y) <= one.radius + keep_off_m
        for one in greenhouse.posts
    )
    return "obstacle" if things or posts else None


def _from_the_middle(area: Rectangle) -> Iterator[tuple[float, float]]:
    """Places on the middle line of a lane, from its middle outwards."""
    x, y = area.middle
    along_x = area.xmax - area.xmin >= area.ymax - area.ymin
    half = (area.xmax - area.xmin if along_x else area.ymax - area.ymin) / 2
    for step in range(int(half / _STEP_M) + 1):
        for away in (step * _STEP_M, -step * _STEP_M):
            yield (x + away, y) if along_x else (x, y + away)
