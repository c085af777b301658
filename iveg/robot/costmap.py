"""Neighbours of a robot, and the fleet's picture for its navigation."""

import logging
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from iveg.domain.costmap import (
    UNKNOWN,
    Grid,
    InflatedGrid,
    Occupancy,
    inflate,
    sweep_of,
    window_round,
)
from iveg.domain.errors import UnreadableError
from iveg.domain.feedback import Feedback
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Origin
from iveg.domain.parameters import Class
from iveg.domain.peer_scan import OLDEST_S, PeerScan
from iveg.domain.witness import Outline
from iveg.ngsi.codec import read_peer_scan

# --- neighbours -------------------------------------------------------------------
#
# People and robots nearby, as reported by peers.

SILENT_S = LIMITS.feedback_stand_s
"""Age from which feedback gives no positions (s)."""
PERSON_M, PEER_M = 0.35, 0.75
_MYSELF_M = 1.0
_MOST = 256


@dataclass(frozen=True, slots=True)
class Neighbour:
    """A person or robot in ``map`` (m).

    Attributes:
        kind: ``person`` or ``robot``.
        radius: Radius of the body (m).
        zone_m: Radius of the rule (m).
    """

    kind: str
    name: str
    x: float
    y: float
    radius: float
    zone_m: float


@dataclass(frozen=True, slots=True)
class _Heard:
    """Newest feedback of a topic.

    Attributes:
        at: When it came (monotonic, s).
        posed: When its pose was news: a peer that is gone keeps the stamp of its last.
    """

    feedback: Feedback
    at: float
    posed: float


class Neighbours:
    """Newest feedback of each topic; times are monotonic seconds.

    Args:
        robot_id: This robot, which is left out.
    """

    def __init__(self, robot_id: str) -> None:
        self._me = robot_id
        self._heard: dict[tuple[str, str | None], _Heard] = {}

    def note(self, peer: str, feedback: Feedback, now: float) -> None:
        """Store the content of ``/{peer}/mqtt_feedback``, of each author apart."""
        key = peer, feedback.origin.boot
        before, stamp = self._heard.get(key), feedback.pose_stamp
        is_old = before is not None and stamp and before.feedback.pose_stamp == stamp
        posed = before.posed if before is not None and is_old else now
        self._heard[key] = _Heard(feedback, now, posed)
        while len(self._heard) > _MOST:
            del self._heard[next(iter(self._heard))]

    def present(self, own: Pose2D | None, now: float) -> list[Neighbour]:
        """All but this robot; one reported on two topics is listed once.

        A peer whose pose stays the same message for ``zone_lasts_s`` is left out:
        nobody knows any more where it is, or that it is there at all.
        """
        live = [one for one in self._heard.values() if now - one.at <= SILENT_S]
        found: dict[object, Neighbour] = {}
        for heard in live:
            feedback = heard.feedback
            for one in self._people(feedback, own):
                found[one.kind, round(one.x, 1), round(one.y, 1)] = one
            peer = feedback.pose if now - heard.posed <= LIMITS.zone_lasts_s else None
            if feedback.robot_id != self._me and peer is not None:
                name = feedback.robot_id
                zone_m = _radius_of(feedback, "robot")
                found[name] = Neighbour("robot", name, peer.x, peer.y, PEER_M, zone_m)
        return list(found.values())[:_MOST]

    def _people(self, feedback: Feedback, own: Pose2D | None) -> Iterator[Neighbour]:
        for alert in feedback.alerts:
            if alert.position is None or alert.class_ is None:
                continue
            x, y, _ = alert.position
            near = own is not None and own.distance_to(x, y) <= _MYSELF_M
            if alert.class_ == "robot" and (alert.class_id == self._me or near):
                continue
            radius = PERSON_M if alert.class_ == "person" else PEER_M
            name = alert.class_id or alert.class_
            zone_m = alert.radius_m or _radius_of(feedback, alert.class_)
            yield Neighbour(alert.class_, name, x, y, radius, zone_m)


def _radius_of(feedback: Feedback, class_: Class) -> float:
    """Radius of the rule for a fresh zone of this class (m)."""
    return feedback.rule.get("radius_m", {}).get(class_, LIMITS.zone_default_m)


# --- costmap ----------------------------------------------------------------------
#
# The fleet's picture on the robot: what peers' lasers and iVeg's feedback tell.
#
# The paper's shared costmap. What a peer's laser met and bodies of people and peers are
# lethal, zones about them dear; what nobody speaks of is unknown, and becomes so again.
# The robot's own laser is left out: its navigation has that first-hand, and here it
# would only come late.

_log = logging.getLogger(__name__)
HALF_LIFE_S = 5.0
"""A peer is heard twice a second: what it sees stays known, what it left does not."""
LETHAL = 100
_TAKEN = 18
"""Cost of a cell that is taken with a probability of 0.65, as map servers count it."""
_WIDEST_M = 1000.0
"""Longer than any greenhouse: an open field, mapped in a window."""
_BESIDE_M = 0.5
"""A peer's laser point so near to this robot is this robot (m)."""
_MOST_PEERS = 64


class FleetCostmap:
    """One robot's grid of the fleet's picture, in ``map``.

    Args:
        robot_id: This robot.
        outline: Its footprint, which is never an obstacle.
        area: What the grid covers; None, or an open field: a window round the robot.

    Attributes:
        refused: Scans that were not used, by reason.
    """

    def __init__(
        self, robot_id: str, outline: Outline, area: Rectangle | None = None
    ) -> None:
        self.refused: Counter[str] = Counter()
        self._me, self._outline = robot_id, outline
        self._fixed = None if area is None or _is_open(area) else Grid.over(area)
        self._known: Occupancy | None = None
        self._iveg_s: float | None = None
        self._waiting: dict[str, PeerScan] = {}
        self._newest: dict[str, Origin] = {}
        self._said: set[tuple[str, str]] = set()

    def hear(self, topic: str, payload: bytes, own: Pose2D | None) -> None:
        """Take a message of ``/{peer}/iveg/peer_scan``; a bad one is only counted.

        Args:
            topic: Its topic.
            payload: Its bytes.
            own: This robot in ``map``; None: it cannot tell itself from an obstacle.
        """
        peer = topic.split("/")[1]
        try:
            scan = read_peer_scan(peer, payload)
            self._refuse_another_time(scan.origin.stamp_s)
        except UnreadableError as error:
            self._refuse(peer, error)
            return
        if peer == self._me or own is None or not self._is_newer(peer, scan.origin):
            return
        beside = _within(self._outline, own, scan.returns(), _BESIDE_M)
        self._waiting[peer] = scan.without(beside)

    def note(self, feedback: Feedback) -> None:
        """Note iVeg's clock, by which scans are stamped too."""
        self._iveg_s = feedback.origin.stamp_s or self._iveg_s

    def drain_scans(self) -> list[PeerScan]:
        """The newest scan of each peer since the last time."""
        waiting, self._waiting = self._waiting, {}
        return list(waiting.values())

    def draw(
        self,
        scans: Iterable[PeerScan],
        neighbours: Iterable[Neighbour],
        own: Pose2D,
        now: float,
    ) -> InflatedGrid:
        """The costs at ``now`` (monotonic, s), with these scans taken in."""
        known = self._known = self._placed(own)
        known.fade(now)
        for scan in scans:
            sweep = sweep_of(scan.scan(), scan.pose, known.grid, scan.returns())
            known.add(sweep)
        costmap = known.costs()
        cost, grid = costmap.data, known.grid
        cost[cost >= _TAKEN] = LETHAL
        for one in neighbours:
            _lay(cost, grid, one)
        _clear_own(cost, grid, self._outline, own)
        return costmap

    def _placed(self, own: Pose2D) -> Occupancy:
        known = self._known
        before = None if known is None else known.grid
        grid = self._fixed or cast("Grid", window_round([own], before))
        if known is None:
            return Occupancy(grid, HALF_LIFE_S)
        return known if known.grid == grid else known.moved_to(grid)

    def _is_newer(self, peer: str, origin: Origin) -> bool:
        before = self._newest.get(peer)
        if before is None and len(self._newest) >= _MOST_PEERS:
            return False
        if (
            before is not None
            and before.boot == origin.boot
            and (origin.seq or 0) <= (before.seq or 0)
        ):
            return False
        self._newest[peer] = origin
        return True

    def _refuse_another_time(self, stamp_s: float | None) -> None:
        """Refuse what waited on its way, or comes of another clock than feedback.

        Raises:
            UnreadableError: ``no_stamp``, ``too_old``, ``from_the_future``.
        """
        if stamp_s is None:
            raise UnreadableError("no_stamp")
        ahead = 0.0 if self._iveg_s is None else stamp_s - self._iveg_s
        if abs(ahead) > OLDEST_S:
            reason = "from_the_future" if ahead > 0.0 else "too_old"
            raise UnreadableError(reason, f"{abs(ahead):.1f} s off the feedback")

    def _refuse(self, peer: str, error: UnreadableError) -> None:
        self.refused[error.reason] += 1
        if (peer, error.reason) not in self._said and len(self._said) < _MOST_PEERS:
            self._said.add((peer, error.reason))
            slots = self._me, peer, error.reason, error.detail
            _log.warning("%s: scan of %s not used: %s, %s", *slots)


def _is_open(area: Rectangle) -> bool:
    return max(area.xmax - area.xmin, area.ymax - area.ymin) > _WIDEST_M


def _lay(cost: NDArray[np.int8], grid: Grid, one: Neighbour) -> None:
    """Lay a body, which is lethal, and its zone over the costs."""
    inflate(cost, grid, one.x, one.y, one.zone_m)
    cells = grid.window(one.x, one.y, one.radius + grid.resolution)
    dx, dy = grid.offsets(cells, one.x, one.y)
    # A cell that the edge of the body runs through is taken, too.
    body = np.hypot(dx, dy) <= one.radius + grid.resolution / math.sqrt(2.0)
    cost[cells][body] = LETHAL


def _clear_own(
    cost: NDArray[np.int8], grid: Grid, outline: Outline, own: Pose2D
) -> None:
    """Make the cells under the robot unknown."""
    # A cell that the edge of the footprint runs through is under it, too.
    beside = grid.resolution / math.sqrt(2.0)
    reach = math.hypot(outline.length, outline.width) / 2 + beside
    cells = grid.window(own.x, own.y, reach)
    dx, dy = grid.offsets(cells, 0.0, 0.0)
    x, y = np.broadcast_arrays(dx, dy)
    points = np.stack((x, y), axis=-1)
    cost[cells][_within(outline, own, points, beside)] = UNKNOWN


def _within(
    outline: Outline, own: Pose2D, points: NDArray[np.float32], beside: float
) -> NDArray[np.bool_]:
    """Which points, shape (…, 2) in ``map``, are in the footprint or ``beside`` (m)."""
    dx, dy = points[..., 0] - own.x, points[..., 1] - own.y
    along = dx * math.cos(own.yaw) + dy * math.sin(own.yaw)
    across = dy * math.cos(own.yaw) - dx * math.sin(own.yaw)
    inside: NDArray[np.bool_] = (np.abs(along) <= outline.length / 2 + beside) & (
        np.abs(across) <= outline.width / 2 + beside
    )
    return inside
