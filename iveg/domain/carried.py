"""What a camera sees in one place of its own picture while the robot drives.

Somebody at a place in the greenhouse comes nearer and goes by.  What stays where it is
as seen from the robot, while that drives, is a part of the robot or dirt on
the lens, which a detector takes for a person, and whose ring goes with the robot and
slows it for ever.  Or somebody walks ahead of it at its own pace: nobody can tell, so
this is told, and no ring is lifted for it.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from iveg.domain.geometry import Pose2D

LASTS_S, GOES_M = 10.0, 3.0
"""For so long, and over so long a way, it has to stay where it is."""
_SAME_M = 0.2
_UNSEEN_S, _OVER_S = 1.0, 10.0
_MOST = 8
"""Of one robot; more at once are people, who pass."""
_Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Carried:
    """Something that goes with a robot, or may yet turn out to.

    Attributes:
        place: In ``base_link`` (m), where it was first.
        since: When that was; ``at`` when it was seen last (monotonic, s).
        way_m: How far the robot had gone when it was seen first.
    """

    place: _Place
    since: float
    at: float
    way_m: float


@dataclass(slots=True)
class CarriedThings:
    """The candidates of one robot, and the way that it has gone."""

    _known: list[Carried] = field(default_factory=list)
    _pose: Pose2D | None = None
    _way_m: float = 0.0
    _found: Carried | None = None

    def note(self, pose: Pose2D, places: Iterable[_Place], at: float) -> None:
        """Take one picture in.

        Args:
            pose: Where the robot was in ``map``.
            places: Of people in it, in ``base_link`` (m).
            at: When it was taken (monotonic, s).
        """
        if self._pose is not None:
            self._way_m += self._pose.distance_to(pose.x, pose.y)
        self._pose = pose
        kept = [one for one in self._known if at - one.at <= _UNSEEN_S]
        for place in places:
            same = next((one for one in kept if _is_at(one, place)), None)
            if same is not None:
                kept[kept.index(same)] = replace(same, at=at)
            elif len(kept) < _MOST:
                kept.append(Carried(place, at, at, self._way_m))
        self._known = kept
        self._found = next(filter(self._goes_along, kept), self._found)

    def found(self, now: float) -> Carried | None:
        """What goes with the robot, if it was so in the last ten seconds."""
        one = self._found
        return one if one is not None and now - one.at <= _OVER_S else None

    def _goes_along(self, one: Carried) -> bool:
        return one.at - one.since >= LASTS_S and self._way_m - one.way_m >= GOES_M


def _is_at(one: Carried, place: _Place) -> bool:
    return math.dist(one.place, place) <= _SAME_M
