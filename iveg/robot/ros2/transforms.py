"""The TF tree of one robot: buffered, interpolated, and honest about what it lacks.

Source: REP-105 and ``tf2``'s buffer.  Unlike there nothing waits and nothing is
extrapolated: a transform is taken between its neighbours in time, or a moment before
the newest (``max_age_s``), or it is missing, and then it says since when.
"""

import math
import operator
from bisect import bisect_left
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from iveg.domain.errors import IvegError
from iveg.domain.geometry import Pose2D
from iveg.ros2 import messages as m

KEPT_S = 10.0
MOST_FRAMES = 256
_MOST_KEPT = 2000
_DEEPEST = 32

Vector = NDArray[np.float64]
"""Shape (3,)."""
Matrix = NDArray[np.float64]
"""Shape (3, 3)."""
_Three = tuple[float, float, float]
_Four = tuple[float, float, float, float]


class NoTransformError(IvegError):
    """A link of the tree is missing or too old.

    Attributes:
        link: Which, as people say it: ``map → odom``.
        for_s: For how long (s); None: it never was.
    """

    def __init__(self, link: str, for_s: float | None) -> None:
        since = "" if for_s is None else f" for {for_s:.1f} s"
        super().__init__(f"no {link}{since}")
        self.link = link
        self.for_s = for_s


@dataclass(frozen=True, slots=True, eq=False)
class Rigid:
    """Where one frame is in another: p_outer = turn · p_inner + move (m)."""

    turn: Matrix
    move: Vector

    def of(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points of the inner frame in the outer; shape (n, 3), (m)."""
        return points @ self.turn.T + self.move

    def compose(self, inner: "Rigid") -> "Rigid":
        """Where the inner one's inner frame is in this one's outer."""
        return Rigid(self.turn @ inner.turn, self.turn @ inner.move + self.move)

    def inverse(self) -> "Rigid":
        """Where the outer frame is in the inner."""
        return Rigid(self.turn.T, -self.turn.T @ self.move)

    def flat(self) -> Pose2D:
        """Seen from above."""
        yaw = math.atan2(self.turn[1, 0], self.turn[0, 0])
        return Pose2D(float(self.move[0]), float(self.move[1]), yaw)

    @property
    def tilt(self) -> float:
        """Angle between the two z axes (rad)."""
        return math.acos(max(-1.0, min(1.0, float(self.turn[2, 2]))))


HERE = Rigid(np.eye(3), np.zeros(3))


def rigid_of(translation: m.Vector3 | m.Point, rotation: m.Quaternion) -> Rigid | None:
    """A translation and a quaternion of any length; None for what is no turn."""
    parts = parts_of(translation, rotation)
    return None if parts is None else Rigid(matrix_of(parts[1]), np.array(parts[0]))


def parts_of(
    translation: m.Vector3 | m.Point, rotation: m.Quaternion
) -> tuple[_Three, _Four] | None:
    """Move and unit quaternion in plain numbers, which for so few NumPy only slows."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    length = math.sqrt(x * x + y * y + z * z + w * w)
    move = translation.x, translation.y, translation.z
    if not (1e-6 < length < math.inf and all(map(math.isfinite, move))):
        return None
    return move, (x / length, y / length, z / length, w / length)


def matrix_of(q: _Four) -> Matrix:
    """The turn of a unit quaternion x, y, z, w."""
    x, y, z, w = q
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )


@dataclass(frozen=True, eq=False)
class _At:
    """One transform at its stamp (s)."""

    stamp: float
    move: _Three
    q: _Four

    def towards(self, later: "_At", stamp: float) -> Rigid:
        """Between the two: straight, and turning least at an even pace (slerp)."""
        part = (stamp - self.stamp) / (later.stamp - self.stamp)
        ends = zip(self.move, later.move, strict=True)
        move = np.array([a + part * (b - a) for a, b in ends])
        return Rigid(matrix_of(_slerp(self.q, later.q, part)), move)

    @cached_property
    def rigid(self) -> Rigid:
        """What is asked for several times a tick, once made."""
        return Rigid(matrix_of(self.q), np.array(self.move))


def _slerp(a: _Four, b: _Four, part: float) -> _Four:
    cosine = sum(map(operator.mul, a, b))
    side = -1.0 if cosine < 0.0 else 1.0
    cosine = abs(cosine)
    if cosine > 0.9995:
        of_a, of_b = 1.0 - part, part
    else:
        angle = math.acos(cosine)
        of_a, of_b = math.sin((1.0 - part) * angle), math.sin(part * angle)
    x, y, z, w = (
        of_a * one + side * of_b * other for one, other in zip(a, b, strict=True)
    )
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


class _Link:
    """What a child frame's parent is, and where it was in it."""

    def __init__(self, parent: str, *, static: bool) -> None:
        self.parent = parent
        self.static = static
        self.known: deque[_At] = deque(maxlen=_MOST_KEPT)

    def add(self, at: _At) -> bool:
        """Keep it; False for one that is not newer than the newest."""
        if self.static:
            self.known.clear()
        elif self.known and at.stamp <= self.known[-1].stamp:
            return False
        self.known.append(at)
        while at.stamp - self.known[0].stamp > KEPT_S:
            self.known.popleft()
        return True


class TransformBuffer:
    """Keeps the tree; stamps are seconds on the clock of the robot's messages.

    Args:
        max_age_s: How much newer than the newest transform a datum may be (s).
    """

    def __init__(self, max_age_s: float = 0.5) -> None:
        self._max_age_s = max_age_s
        self._links: dict[str, _Link] = {}

    def add(self, message: m.TFMessage, *, static: bool) -> int:
        """Take what ``/tf`` or ``/tf_static`` says.

        Returns:
            How many of its transforms cannot be used or are not news.
        """
        return sum(not self._add(one, static=static) for one in message.transforms)

    def _add(self, one: m.TransformStamped, *, static: bool) -> bool:
        parent = one.header.frame_id.lstrip("/")
        child = one.child_frame_id.lstrip("/")
        parts = parts_of(one.transform.translation, one.transform.rotation)
        if parts is None or not parent or not child or parent == child:
            return False
        link = self._links.get(child)
        if link is None or link.parent != parent or link.static != static:
            if link is None and len(self._links) >= MOST_FRAMES:
                return False
            link = self._links[child] = _Link(parent, static=static)
        return link.add(_At(one.header.stamp.seconds, *parts))

    def clear(self) -> None:
        """Forget what moves: time itself has jumped."""
        self._links = {c: one for c, one in self._links.items() if one.static}

    def lookup(self, outer: str, inner: str, stamp: float) -> Rigid:
        """Where ``inner`` is in ``outer`` at a stamp.

        Raises:
            NoTransformError: a link is missing, or old at this stamp.
        """
        up, down = self._ancestors(inner), self._ancestors(outer)
        shared = next((frame for frame in up if frame in down), None)
        if shared is None:
            raise NoTransformError(self._gap(up, down), None)
        here = self._climb(up[: up.index(shared)], stamp)
        there = self._climb(down[: down.index(shared)], stamp)
        return there.inverse().compose(here)

    def _ancestors(self, frame: str) -> list[str]:
        found = [frame]
        while (link := self._links.get(found[-1])) and len(found) < _DEEPEST:
            found.append(link.parent)
        return found

    def _gap(self, up: Iterable[str], down: Iterable[str]) -> str:
        """The link that would join two trees: from one's root to the other's."""
        return f"{list(down)[-1]} → {list(up)[-1]}"

    def _climb(self, frames: Iterable[str], stamp: float) -> Rigid:
        rigid = HERE
        for frame in frames:
            rigid = self._at(frame, stamp).compose(rigid)
        return rigid

    def _at(self, child: str, stamp: float) -> Rigid:
        link = self._links[child]
        known, name = link.known, f"{link.parent} → {child}"
        if link.static:
            return known[-1].rigid
        newest, oldest = known[-1], known[0]
        if stamp >= newest.stamp:
            if stamp - newest.stamp > self._max_age_s:
                raise NoTransformError(name, stamp - newest.stamp)
            return newest.rigid
        if stamp < oldest.stamp:
            if oldest.stamp - stamp > self._max_age_s:
                raise NoTransformError(name, None)
            return oldest.rigid
        place = bisect_left(known, stamp, key=lambda one: one.stamp)
        if known[place].stamp == stamp:
            return known[place].rigid
        return known[place - 1].towards(known[place], stamp)

    def age(self, child: str, stamp: float) -> float | None:
        """How old a frame's newest transform is (s); 0 for a static one."""
        link = self._links.get(child)
        if link is None:
            return None
        return 0.0 if link.static else stamp - link.known[-1].stamp

    def chain(self, inner: str) -> tuple[str, ...]:
        """A frame and all above it."""
        return tuple(self._ancestors(inner))
