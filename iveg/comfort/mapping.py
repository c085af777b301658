"""Keeps the costmaps up to date: one scan at a time, never one for each message.

A scan costs about as much as a hundred decisions, and no robot stops for the costmap.
So it is drawn beside the rule loop, from the newest scan of the robot that has waited
longest, and a fleet that sends more is drawn less often.
"""

import asyncio
from collections.abc import Iterable

from iveg.comfort.scans import ScanReader
from iveg.domain.costmap import (
    Grid,
    InflatedGrid,
    Occupancy,
    Sweep,
    sweep_of,
    window_round,
)
from iveg.domain.geometry import Rectangle
from iveg.domain.observations import Instant, LaserScan, UnreadScan
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.zones import Zone
from iveg.domain.world import World
from iveg.vital.ports import Clock

TICK_S = 0.05
_PERIOD_S = 0.25
_WIDEST_M = 1000.0
"""Longer than any greenhouse: an open field, mapped in a window round the robots."""


class Mapper:
    """One grid that the fleet shares, and one for each robot.

    Args:
        bounds: The outer wall of the greenhouse.
        scans: Reads them.
    """

    def __init__(
        self,
        world: World,
        bounds: Rectangle,
        scans: ScanReader | None = None,
    ) -> None:
        self._world = world
        self._scans = scans or ScanReader()
        wide = max(bounds.xmax - bounds.xmin, bounds.ymax - bounds.ymin)
        self._is_open = wide > _WIDEST_M
        self._grid = None if self._is_open else Grid.over(bounds)
        # By robot; the fleet shares that of None.
        self._drawn: dict[str | None, Occupancy] = {}
        self._read: dict[str, LaserScan | UnreadScan] = {}
        self._read_at: dict[str, float] = {}

    async def run(self, clock: Clock) -> None:
        """Until cancelled."""
        while True:
            self.tick(clock())
            await asyncio.sleep(TICK_S)

    def tick(self, now: Instant) -> None:
        """Take in the scan that has waited longest, if one is due."""
        due = [robot for robot in self._world.live_robots() if self._is_due(robot, now)]
        if due:
            self._draw(min(due, key=self._last_drawn), now)

    def shared(self, zones: Iterable[Zone], now: Instant) -> InflatedGrid | None:
        """The fleet's costmap; None before the first scan."""
        return _costs(self._drawn.get(None), zones, now)

    def age_s(self, robot_id: str | None, now: Instant) -> float | None:
        """Since the newest scan of one robot, or of any, was drawn (s); None: never."""
        times = self._read_at
        found = times.values() if robot_id is None else [times.get(robot_id)]
        drawn = [at for at in found if at is not None]
        return now.mono - max(drawn) if drawn else None

    def of(
        self, robot_id: str, zones: Iterable[Zone], now: Instant
    ) -> InflatedGrid | None:
        """Costmap of one robot: its own scans, people and peers of its feedback."""
        others = [zone for zone in zones if zone.cause != robot_id]
        return _costs(self._drawn.get(robot_id), others, now)

    def _is_due(self, robot: RobotState, now: Instant) -> bool:
        scan = robot.scan
        if scan is None or robot.scan_pose is None:
            return False
        fresh = scan is not self._read.get(robot.robot_id)
        return fresh and now.mono - self._last_drawn(robot) >= _PERIOD_S

    def _last_drawn(self, robot: RobotState) -> float:
        return self._read_at.get(robot.robot_id, float("-inf"))

    def _draw(self, robot: RobotState, now: Instant) -> None:
        pose = robot.scan_pose
        self._place()
        if robot.scan is None or pose is None or self._grid is None:
            return
        self._read[robot.robot_id] = robot.scan
        self._read_at[robot.robot_id] = now.mono
        scan = self._scans.newest(robot)
        if scan is None:
            return
        try:
            sweep = sweep_of(scan, pose, self._grid)
        except Exception as error:
            # One robot's scan ends neither this part nor the drawing of the others.
            self._scans.undrawable(robot.robot_id, error)
            return
        for key in (None, robot.robot_id):
            self._drawn[key] = _added(self._drawn.get(key), self._grid, sweep, now)

    def _place(self) -> None:
        """In an open field the grids move with the robots."""
        if self._is_open:
            robots = self._world.live_robots()
            poses = [robot.scan_pose for robot in robots if robot.scan_pose is not None]
            self._grid = window_round(poses, self._grid)


def _added(
    known: Occupancy | None, grid: Grid, sweep: Sweep, now: Instant
) -> Occupancy:
    occupancy = Occupancy(grid) if known is None else known
    if occupancy.grid != grid:
        occupancy = occupancy.moved_to(grid)
    occupancy.fade(now.mono)
    occupancy.add(sweep)
    return occupancy


def _costs(
    occupancy: Occupancy | None, zones: Iterable[Zone], now: Instant
) -> InflatedGrid | None:
    if occupancy is None:
        return None
    occupancy.fade(now.mono)
    return occupancy.costs(zone for zone in zones if zone.recording is None)
