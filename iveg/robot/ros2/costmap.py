"""The fleet's picture for Nav2's static layer: ``nav_msgs/OccupancyGrid`` in ``map``.

Comfort: it is drawn in another thread while somebody listens, asks for scans of peers
only then, and its failure is logged and ends nothing.
"""

import asyncio
import logging
from collections.abc import Callable

import numpy as np

from iveg.adapters import clock
from iveg.domain.costmap import UNKNOWN, InflatedGrid
from iveg.domain.geometry import Pose2D
from iveg.robot.costmap import FleetCostmap
from iveg.robot.neighbours import Neighbours
from iveg.robot.ros2.network import Writer
from iveg.ros2 import cdr, geometry_msgs, nav_msgs, std_msgs

_log = logging.getLogger(__name__)
EVERY_S = 0.5


class CostmapTopic:
    """Draws and publishes one robot's costmap.

    Args:
        writer: Of its topic, transient local.
        costmap: What it knows.
        neighbours: People and peers.
        frame: Name of ``map``.
        place: Where the robot is; None while nobody knows.
        ask: Called with whether scans of peers are wanted.
    """

    def __init__(
        self,
        writer: Writer,
        costmap: FleetCostmap,
        neighbours: Neighbours,
        frame: str,
        place: Callable[[], Pose2D | None],
        ask: Callable[[bool], None],
    ) -> None:
        self._writer, self._costmap, self._neighbours = writer, costmap, neighbours
        self._frame, self._place, self._ask = frame, place, ask
        self._newest: InflatedGrid | None = None

    def hear(self, topic: str, payload: bytes) -> None:
        """Take a scan of a peer."""
        self._costmap.hear(topic, payload, self._place())

    async def run(self) -> None:
        """Until cancelled."""
        said = False
        while True:
            try:
                await self._tell()
                said = False
            except Exception:
                if not said:
                    _log.exception("the costmap has failed; the gate goes on")
                said = True
            await asyncio.sleep(EVERY_S)

    async def _tell(self) -> None:
        own = self._place()
        wanted = self._writer.readers > 0
        self._ask(wanted)
        if wanted and own is not None:
            now, scans = clock.now(), self._costmap.drain_scans()
            present = self._neighbours.present(own, now.mono)
            self._newest = await asyncio.to_thread(
                self._costmap.draw, scans, present, own, now.mono
            )
            self._write(self._newest)
        elif self._newest is not None:
            self._withdraw(self._newest)

    def _withdraw(self, newest: InflatedGrid) -> None:
        """Leave a grid that claims nothing to whoever listens next."""
        nothing = np.full_like(newest.data, UNKNOWN)
        self._write(InflatedGrid(newest.grid, nothing))
        self._newest = None

    def _write(self, costmap: InflatedGrid) -> None:
        stamp = std_msgs.Time.of(clock.wall())
        self._writer.write(cdr.write(occupancy_grid(costmap, stamp, self._frame)))


def occupancy_grid(
    costmap: InflatedGrid, stamp: std_msgs.Time, frame: str
) -> nav_msgs.OccupancyGrid:
    """The message of a costmap."""
    grid = costmap.grid
    corner = geometry_msgs.Pose(geometry_msgs.Point(grid.xmin, grid.ymin))
    info = nav_msgs.MapMetaData(stamp, grid.resolution, grid.width, grid.height, corner)
    return nav_msgs.OccupancyGrid(
        std_msgs.Header(stamp, frame), info, costmap.data.reshape(-1)
    )
