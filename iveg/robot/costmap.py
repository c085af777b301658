"""Costmap of the fleet on a robot, from peers' lasers and iVeg's feedback.

The paper's shared costmap.  Returns of a peer's laser and bodies of people and peers
are lethal, and their zones cost more towards the middle.  Cells that no message covers
are unknown, and become so again.
The robot's own laser is left out: its navigation has that first-hand, and here it
would only come late.
"""

import logging
import math
from collections.abc import Iterable
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
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.laser import Outline
from iveg.domain.observations import Origin
from iveg.domain.peer_scan import OLDEST_S, PeerScan
from iveg.ngsi.codec import read_peer_scan
from iveg.robot.peer_alerts import Neighbour

_log = logging.getLogger(__name__)
HALF_LIFE_S = 5.0
"""Half-life of a cell's evidence (s): scans of a peer come twice a second, so what it
sees stays known and what it left does not."""
LETHAL = 100
_TAKEN = 18
"""Cost of a cell that is taken with a probability of 0.65, as map servers count it."""
_WIDEST_M = 1000.0
"""Longer than any greenhouse: an open field, mapped in a window."""
_BESIDE_M = 0.5
"""A peer's laser point this near to the robot is the robot itself (m)."""


class FleetCostmap:
    """Grid of one robot, in ``map``.

    Args:
        robot_id: This robot.
        outline: Its footprint, which is never an obstacle.
        area: Area of the grid; None, or an open field: a window round the robot.
    """

    def __init__(
        self, robot_id: str, outline: Outline, area: Rectangle | None = None
    ) -> None:
        self._me, self._outline = robot_id, outline
        self._fixed: Grid | None = None
        if area is not None:
            widest_m = max(area.xmax - area.xmin, area.ymax - area.ymin)
            self._fixed = Grid.over(area) if widest_m <= _WIDEST_M else None
        self._known: Occupancy | None = None
        self._waiting: dict[str, PeerScan] = {}
        self._newest: dict[str, Origin] = {}
        self._logged: set[str] = set()

    def receive(
        self, topic: str, payload: bytes, own: Pose2D | None, iveg_s: float | None
    ) -> None:
        """Take a message of ``/{peer}/iveg/peer_scan``; a bad one is ignored.

        Args:
            topic: Its topic.
            payload: Its bytes.
            own: This robot in ``map``; None: it cannot tell itself from an obstacle.
            iveg_s: Stamp of the newest feedback, of the clock that stamps scans (s).
        """
        peer = topic.split("/")[1]
        try:
            scan = read_peer_scan(peer, payload)
            _refuse_another_time(scan.origin.stamp_s, iveg_s)
        except UnreadableError as error:
            if error.reason not in self._logged:
                self._logged.add(error.reason)
                _log.warning("%s: scan of %s not used: %s", self._me, peer, error)
            return
        if peer == self._me or own is None or not self._is_newer(peer, scan.origin):
            return
        beside = _within(self._outline, own, scan.returns(), _BESIDE_M)
        self._waiting[peer] = scan.without(beside)

    def drain_scans(self) -> list[PeerScan]:
        """Newest scan of each peer since the last call; each is returned once."""
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
            known.add(sweep_of(scan.scan(), scan.pose, known.grid, scan.returns()))
        costmap = known.costs()
        cost, grid = costmap.data, known.grid
        cost[cost >= _TAKEN] = LETHAL
        for neighbour in neighbours:
            _lay(cost, grid, neighbour)
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
        # Stamps prove no order; the count of a boot does, and a new boot begins anew.
        if (
            before is not None
            and before.boot == origin.boot
            and (origin.seq or 0) <= (before.seq or 0)
        ):
            return False
        self._newest[peer] = origin
        return True


def _refuse_another_time(stamp_s: float | None, iveg_s: float | None) -> None:
    """Refuse a scan that waited on its way, or is of another clock than feedback.

    Raises:
        UnreadableError: ``no_stamp``, ``too_old``, ``from_the_future``.
    """
    if stamp_s is None:
        raise UnreadableError("no_stamp")
    ahead_s = 0.0 if iveg_s is None else stamp_s - iveg_s
    if abs(ahead_s) > OLDEST_S:
        reason = "from_the_future" if ahead_s > 0.0 else "too_old"
        raise UnreadableError(reason, f"{abs(ahead_s):.1f} s off the feedback")


def _lay(cost: NDArray[np.int8], grid: Grid, near: Neighbour) -> None:
    """Lay a body, which is lethal, and its zone over the costs."""
    inflate(cost, grid, near.x, near.y, near.zone_m)
    cells = grid.window(near.x, near.y, near.body_m + grid.resolution)
    dx, dy = grid.offsets(cells, near.x, near.y)
    # A cell that the edge of the body runs through is taken, too.
    body = np.hypot(dx, dy) <= near.body_m + grid.resolution / math.sqrt(2.0)
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
    points = np.stack(np.broadcast_arrays(dx, dy), axis=-1)
    cost[cells][_within(outline, own, points, beside)] = UNKNOWN


def _within(
    outline: Outline, own: Pose2D, points: NDArray[np.float32], beside: float
) -> NDArray[np.bool_]:
    """Mask of points, shape (…, 2), in the footprint or within ``beside`` (m) of it."""
    along, across = own.inverse(*np.moveaxis(points, -1, 0))
    inside: NDArray[np.bool_] = (np.abs(along) <= outline.length / 2 + beside) & (
        np.abs(across) <= outline.width / 2 + beside
    )
    return inside
