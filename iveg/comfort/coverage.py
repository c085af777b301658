"""Keeps the camera coverage up to date, beside the rule loop.

No robot stops for it, and aisles do not change: twice a second is often enough.
"""

import asyncio

from iveg.domain.coverage import AisleCoverage
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.tracking.sight import is_detecting
from iveg.domain.world import World
from iveg.vital.ports import Clock

TICK_S = 0.5


class CoverageMonitor:
    """When each cell of the aisles was last in view.

    Attributes:
        coverage: What was looked at, and when.
    """

    def __init__(self, world: World, greenhouse: Greenhouse) -> None:
        self._world = world
        self.coverage = AisleCoverage(greenhouse)

    async def run(self, clock: Clock) -> None:
        """Until cancelled."""
        while True:
            self.tick(clock())
            await asyncio.sleep(TICK_S)

    def tick(self, now: Instant) -> None:
        """Take in what the cameras have in view now."""
        self.coverage.update(self._world.live_robots(), now)

    def cameras(self, now: Instant) -> int:
        """Number of cameras that work now, wherever they are."""
        return sum(is_detecting(robot, now) for robot in self._world.live_robots())
