"""How far off a robot's camera places its peers, by their own poses.

Robots are each other's ground truth: whom one of them sees, another one *is*.  A mount
that is not where the fleet file says, or a pose that drifts, is an error that stays the
same in the frame of the robot that looks; its median over many looks is the *bias*.  A
box may end at the near side of a body, so that nearer by up to half of its length is
no error.
"""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from statistics import median

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import Instant

WARN_M = 0.3
"""A bias above this is an alert (P3): a ring of 2 m is drawn so far off (m)."""
_FEWEST, _MOST = 10, 60
"""Looks that a bias needs, and that are kept."""
_APART_S, _LASTS_S = 0.5, 600.0
"""Pictures of one moment are one look; looks this old no longer count (s)."""


@dataclass(frozen=True, slots=True)
class Bias:
    """Median error of a camera's places.

    Attributes:
        ahead_m: In the robot's frame (m); positive: seen farther ahead than it is.
        left_m: Likewise; positive: seen farther to the left.
        looks: How many looks it is of; ``last_at`` the newest (monotonic, s).
    """

    ahead_m: float
    left_m: float
    looks: int
    last_at: float

    @property
    def off_m(self) -> float:
        """How far that is (m)."""
        return math.hypot(self.ahead_m, self.left_m)


@dataclass(slots=True)
class PeerLooks:
    """Errors of one robot's looks at peers: when (monotonic, s), ahead, left (m)."""

    _looks: deque[tuple[float, float, float]] = field(
        default_factory=lambda: deque(maxlen=_MOST)
    )

    def note(self, at: float, error: tuple[float, float]) -> None:
        """Take one detection in; ``error`` as ``peer_error`` tells it."""
        if not self._looks or at - self._looks[-1][0] >= _APART_S:
            self._looks.append((at, *error))

    def bias(self, now: Instant) -> Bias | None:
        """The bias; None: too few looks in the last ten minutes."""
        looks = [*self._young(now)]
        if len(looks) < _FEWEST:
            return None
        _, ahead, left = zip(*looks, strict=True)
        return Bias(median(ahead), median(left), len(looks), looks[-1][0])

    def _young(self, now: Instant) -> Iterator[tuple[float, float, float]]:
        return (one for one in self._looks if now.mono - one[0] <= _LASTS_S)


def peer_error(
    seen: tuple[float, float], pose: Pose2D, peer: Pose2D, half_length: float
) -> tuple[float, float]:
    """From where a peer is to where it was seen, ahead and left of the robot (m).

    Args:
        seen: Centre of the detection in ``map`` (m).
        pose: Of the robot that looks, then; ``peer`` of the one that is seen.
        peer: See above.
        half_length: Half of the peer's length (m).
    """
    dx, dy = seen[0] - peer.x, seen[1] - peer.y
    bearing = math.atan2(peer.y - pose.y, peer.x - pose.x)
    c, s = math.cos(bearing), math.sin(bearing)
    along, across = c * dx + s * dy, c * dy - s * dx
    if along < 0.0:
        along = min(0.0, along + half_length)
    turn = bearing - pose.yaw
    c, s = math.cos(turn), math.sin(turn)
    return c * along - s * across, s * along + c * across
