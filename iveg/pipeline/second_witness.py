"""The laser as a second witness, beside the rule loop: one scan at a time.

A scan costs about as much as ten decisions.  So it is looked at beside the loop, the
newest of the robot that has waited longest: five times a second, or ten while somebody
may be there, and a hundred a second of all at most.
"""

import asyncio
from collections.abc import Callable

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, LaserScan, UnreadScan
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.obstacles import Obstacles
from iveg.domain.world import World
from iveg.pipeline.ports import Clock
from iveg.pipeline.scans import ScanReader

TICK_S = 0.01
_APART_S, _UNSURE_S = 0.19, 0.09
"""Between two looks of one robot (s), at least; while it may see somebody."""
_FRESH_S = 0.5
_NEVER = float("-inf")


class SecondWitness:
    """Looks at the scans of the fleet.

    Args:
        scans: Reads them.
        obstacles: Takes what they show.
        looked: Told of each look before it.
    """

    def __init__(
        self,
        world: World,
        scans: ScanReader,
        obstacles: Obstacles,
        looked: Callable[[Instant], None] = lambda _: None,
    ) -> None:
        self._world, self._scans, self._obstacles = world, scans, obstacles
        self._tell = looked
        self._looked: dict[str, tuple[float, LaserScan | UnreadScan]] = {}

    async def run(self, clock: Clock) -> None:
        """Until cancelled."""
        while True:
            self.tick(clock())
            await asyncio.sleep(TICK_S)

    def tick(self, now: Instant) -> bool:
        """Look at the scan that has waited longest; returns whether one was due."""
        due = [robot for robot in self._world.live_robots() if self._is_due(robot, now)]
        if due:
            self._tell(now)
            self._look(min(due, key=self._looked_at), now)
        return bool(due)

    def _is_due(self, robot: RobotState, now: Instant) -> bool:
        # First what most fail: this is asked of everybody, a hundred times a second.
        at, scan = self._looked.get(robot.robot_id, (_NEVER, None))
        if robot.scan is None or robot.scan is scan or now.mono - at < _UNSURE_S:
            return False
        if now.mono - at < _APART_S and not self._obstacles.is_unsure(robot.robot_id):
            return False
        received, age = robot.scan_received, robot.age_s(now)
        is_fresh = received is not None and now.mono - received.mono <= _FRESH_S
        return is_fresh and age is not None and age <= LIMITS.live_s

    def _looked_at(self, robot: RobotState) -> float:
        return self._looked.get(robot.robot_id, (_NEVER, None))[0]

    def _look(self, robot: RobotState, now: Instant) -> None:
        waiting, received = robot.scan, robot.scan_received
        if waiting is None or received is None:
            return
        self._looked[robot.robot_id] = now.mono, waiting
        scan = self._scans.newest(robot)
        if scan is None:
            return
        try:
            self._obstacles.look(robot, scan, received)
        except Exception as error:
            # One robot's scan ends neither this part nor the looks of the others.
            self._scans.undrawable(robot.robot_id, error)
