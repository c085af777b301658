"""Something near a robot that its laser sees and nobody explains."""

import math
from dataclasses import dataclass, replace

from iveg.domain.geometry import Rectangle

LASTS_S = 0.2
"""What is shorter is noise, or an insect."""
_LARGEST_M = 1.0
"""Two people side by side; what is larger is counted once it moves."""
_MOVED_M = 0.4
_SMOOTHED_S = 0.4
_WALKED_M, _WALKED_S, _PASSED_M = 0.5, 0.5, 0.3
"""Who walks goes so far, for so long, and so far as seen from the robot: not so what it
tows, nor the part of a wall that it sees as it passes."""
_WALKS_M_S = (0.3, 2.5)
_STANDS_S = 10.0
"""Who walked and stands since is still somebody, for as long as a ring lasts."""

_EVERYWHERE = Rectangle(-math.inf, -math.inf, math.inf, math.inf)


@dataclass(frozen=True, slots=True)
class Body:
    """Neighbouring returns of one scan that nobody explained.

    Attributes:
        x: Their middle in ``map`` (m); ``y`` likewise.
        size_m: From the first to the last.
        gap_m: From the robot's outline to the nearest.
        beside: Their middle in the robot's ``base_link`` (m).
        around: The box in ``map`` that holds them.
        out_m: How far from what the plan draws the farthest is (m); infinite without a
            plan.
    """

    x: float
    y: float
    size_m: float
    gap_m: float
    beside: tuple[float, float]
    around: Rectangle
    out_m: float


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Something of a person's size near a robot that nobody explained.

    Attributes:
        x: Its middle in ``map`` (m); ``y`` likewise.
        first_x: Where it was when it was seen first; ``first_y`` likewise.
        size_m: From its first return to its last.
        gap_m: From the robot's outline to its nearest return.
        first_seen: Where that was in the robot's ``base_link`` (m).
        since: When it was seen first; ``at`` newest (monotonic, s).
        vx: How it goes in ``map`` (m/s), smoothed over 0.4 s; ``vy`` likewise.
        passed_m: How far from where the robot saw it first, as seen from the robot (m).
        walked_at: When it last moved like somebody who walks (monotonic, s).
        around: The box in ``map`` that holds every return that it ever had.
        out_m: How far from what the plan draws the farthest of them was (m).
        most_way_m: How far its middle ever was from where it was first (m).
        beside: Where it is in the robot's ``base_link`` (m).
    """

    x: float
    y: float
    first_x: float
    first_y: float
    size_m: float
    gap_m: float
    since: float
    at: float
    first_seen: tuple[float, float]
    vx: float = 0.0
    vy: float = 0.0
    passed_m: float = 0.0
    walked_at: float = -math.inf
    around: Rectangle = _EVERYWHERE
    out_m: float = math.inf
    most_way_m: float = 0.0
    beside: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def new(cls, body: Body, now: float) -> "Obstacle":
        """Something that is seen for the first time."""
        x, y = body.x, body.y
        return cls(
            x,
            y,
            x,
            y,
            body.size_m,
            body.gap_m,
            now,
            now,
            body.beside,
            around=body.around,
            out_m=body.out_m,
            beside=body.beside,
        )

    @property
    def way_m(self) -> float:
        """How far it is from where it was first (m)."""
        return math.hypot(self.x - self.first_x, self.y - self.first_y)

    @property
    def has_moved(self) -> bool:
        """Whether it went farther than noise does."""
        return self.way_m > _MOVED_M

    @property
    def is_somebody(self) -> bool:
        """Whether it walks, or walked just now."""
        return self.at - self.walked_at <= _STANDS_S

    @property
    def walks(self) -> bool:
        """Whether it moves like somebody who walks."""
        least, most = _WALKS_M_S
        return (
            self.size_m <= _LARGEST_M
            and self.at - self.since >= _WALKED_S - 1e-6
            and self.way_m >= _WALKED_M
            and self.passed_m >= _PASSED_M
            and least <= math.hypot(self.vx, self.vy) <= most
        )

    @property
    def stirred(self) -> bool:
        """Whether it ever moved farther than noise does, or walked just now."""
        return self.most_way_m > _MOVED_M or self.is_somebody

    def seen_again(self, body: Body, now: float) -> "Obstacle":
        """The same, seen again."""
        gain = (now - self.at) / (_SMOOTHED_S + now - self.at)
        after_s = max(now - self.at, 1e-3)
        way_m = math.hypot(body.x - self.first_x, body.y - self.first_y)
        seen = replace(
            self,
            x=body.x,
            y=body.y,
            size_m=body.size_m,
            gap_m=body.gap_m,
            at=now,
            vx=self.vx + gain * ((body.x - self.x) / after_s - self.vx),
            vy=self.vy + gain * ((body.y - self.y) / after_s - self.vy),
            passed_m=math.dist(body.beside, self.first_seen),
            around=self.around.joined(body.around),
            out_m=max(self.out_m, body.out_m),
            most_way_m=max(self.most_way_m, way_m),
            beside=body.beside,
        )
        return replace(seen, walked_at=now) if seen.walks else seen

    @property
    def fits(self) -> bool:
        """Whether it is or moves like somebody."""
        return self.size_m <= _LARGEST_M or self.has_moved

    @property
    def counts(self) -> bool:
        """Whether it is there for long enough, too."""
        return self.fits and self.at - self.since >= LASTS_S - 1e-6
