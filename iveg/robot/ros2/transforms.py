"""TF tree of one robot, buffered and interpolated.

Source: REP-105 and ``tf2``'s buffer.  Unlike there lookups never wait or extrapolate: a
transform is interpolated, or is the newest for up to ``max_age_s``, or it is missing,
with the time since when.
"""

from bisect import bisect_left
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from iveg.domain.errors import IvegError
from iveg.robot.ros2.rigid import IDENTITY, RigidTransform, rigid_of
from iveg.ros2 import geometry_msgs

KEPT_S = 10.0
MOST_FRAMES = 256
_MOST_KEPT = 2000
_DEEPEST = 32


class NoTransformError(IvegError):
    """A link of the tree is missing or too old.

    Attributes:
        link: Its two frames: ``map → odom``.
        for_s: Time since the last one (s); None: there never was one.
    """

    def __init__(self, link: str, for_s: float | None) -> None:
        since = "" if for_s is None else f" for {for_s:.1f} s"
        super().__init__(f"no {link}{since}")
        self.link = link
        self.for_s = for_s


@dataclass(frozen=True, slots=True)
class _At:
    """One transform at its stamp (s)."""

    stamp: float
    rigid: RigidTransform


class _Link:
    """Parent of a child frame, with its transforms."""

    def __init__(self, parent: str, *, static: bool) -> None:
        self.parent = parent
        self.static = static
        self.known: deque[_At] = deque(maxlen=_MOST_KEPT)

    def add(self, at: _At) -> bool:
        """Store it; False if it is not newer than the newest."""
        if self.static:
            self.known.clear()
        elif self.known and at.stamp <= self.known[-1].stamp:
            return False
        self.known.append(at)
        while at.stamp - self.known[0].stamp > KEPT_S:
            self.known.popleft()
        return True


class TransformBuffer:
    """Buffer of the tree; stamps are seconds on the clock of the robot's messages.

    Args:
        max_age_s: Greatest lead of a datum over the newest transform (s).
    """

    def __init__(self, max_age_s: float = 0.5) -> None:
        self._max_age_s = max_age_s
        self._links: dict[str, _Link] = {}

    def add(self, message: geometry_msgs.TFMessage, *, static: bool) -> int:
        """Take a message of ``/tf`` or ``/tf_static``.

        Returns:
            Number of its transforms that are unusable or not new.
        """
        return sum(not self._add(one, static=static) for one in message.transforms)

    def _add(self, one: geometry_msgs.TransformStamped, *, static: bool) -> bool:
        parent = one.header.frame_id.lstrip("/")
        child = one.child_frame_id.lstrip("/")
        rigid = rigid_of(one.transform.translation, one.transform.rotation)
        if rigid is None or not parent or not child or parent == child:
            return False
        link = self._links.get(child)
        if link is None or link.parent != parent or link.static != static:
            if link is None and len(self._links) >= MOST_FRAMES:
                return False
            link = self._links[child] = _Link(parent, static=static)
        return link.add(_At(one.header.stamp.seconds, rigid))

    @property
    def newest(self) -> float:
        """Newest stamp of a transform that is not static (s); 0 without one."""
        links = self._links.values()
        return max(
            (one.known[-1].stamp for one in links if not one.static), default=0.0
        )

    def clear(self) -> None:
        """Delete dynamic transforms, since the clock was reset."""
        self._links = {c: one for c, one in self._links.items() if one.static}

    def lookup(self, outer: str, inner: str, stamp: float) -> RigidTransform:
        """Transform from ``inner`` to ``outer`` at a stamp.

        Raises:
            NoTransformError: a link is missing, or old at this stamp.
        """
        up = self.chain(inner)
        if outer in up:  # the usual case
            return self._climb(up[: up.index(outer)], stamp)
        down = self.chain(outer)
        shared = next((frame for frame in up if frame in down), None)
        if shared is None:
            # The missing link leads from the root of one tree to that of the other.
            raise NoTransformError(f"{down[-1]} → {up[-1]}", None)
        here = self._climb(up[: up.index(shared)], stamp)
        there = self._climb(down[: down.index(shared)], stamp)
        return there.inverse().compose(here)

    def chain(self, frame: str) -> list[str]:
        """A frame and all its ancestors."""
        found = [frame]
        while (link := self._links.get(found[-1])) and len(found) < _DEEPEST:
            found.append(link.parent)
        return found

    def _climb(self, frames: Iterable[str], stamp: float) -> RigidTransform:
        rigid: RigidTransform | None = None
        for frame in frames:
            outer = self._at(frame, stamp)
            rigid = outer if rigid is None else outer.compose(rigid)
        return IDENTITY if rigid is None else rigid

    def _at(self, child: str, stamp: float) -> RigidTransform:
        link = self._links[child]
        known = link.known
        if link.static:
            return known[-1].rigid
        newest, oldest = known[-1], known[0]
        if stamp >= newest.stamp:
            if stamp - newest.stamp > self._max_age_s:
                raise NoTransformError(f"{link.parent} → {child}", stamp - newest.stamp)
            return newest.rigid
        if stamp < oldest.stamp:
            if oldest.stamp - stamp > self._max_age_s:
                raise NoTransformError(f"{link.parent} → {child}", None)
            return oldest.rigid
        place = bisect_left(known, stamp, key=lambda one: one.stamp)
        if known[place].stamp == stamp:
            return known[place].rigid
        before, after = known[place - 1], known[place]
        part = (stamp - before.stamp) / (after.stamp - before.stamp)
        return before.rigid.towards(after.rigid, part)
