"""Scans of peers for robots that ask: comfort, one at a time, the newest of each.

A robot asks in its safety report (docs/interfaces/mqtt.md).  Never two in one turn, so
that no feedback waits behind a burst; a large fleet is told less often.
"""

import asyncio
from collections.abc import Callable
from dataclasses import replace

from iveg.comfort.scans import ScanReader
from iveg.comfort.situations import fresh_report
from iveg.domain.observations import Instant, LaserScan, Origin, UnreadScan
from iveg.domain.peer_scan import OLDEST_S, PeerScan, peer_scan_of
from iveg.domain.robot_state import RobotState
from iveg.domain.stamps import format_stamp
from iveg.domain.world import World
from iveg.vital.ports import Clock

TICK_S = 0.05
APART_S = 0.5
"""Between two scans of one robot (s), at least."""


class PeerScans:
    """Hands scans on while any robot asks.

    Args:
        scans: Reads them.
        publish: Takes what is told.
        boot: Of iVeg, as in feedback.
    """

    def __init__(
        self,
        world: World,
        scans: ScanReader,
        publish: Callable[[PeerScan], None],
        boot: str,
    ) -> None:
        self._world, self._scans, self._publish = world, scans, publish
        self._boot, self._seq = boot, 0
        self._handled: dict[str, tuple[float, LaserScan | UnreadScan]] = {}

    async def run(self, clock: Clock) -> None:
        """Until cancelled."""
        while True:
            self.tick(clock())
            await asyncio.sleep(TICK_S)

    def tick(self, now: Instant) -> None:
        """Hand on the scan of the robot that has waited longest, if one is due."""
        asking = {
            robot.robot_id for robot in self._world.live_robots() if _asks(robot, now)
        }
        if not asking:
            return
        due = [
            robot
            for robot in self._world.live_robots()
            if asking - {robot.robot_id} and self._is_due(robot, now)
        ]
        if due:
            self._tell(min(due, key=self._handled_at), now)

    def _is_due(self, robot: RobotState, now: Instant) -> bool:
        received = robot.scan_received
        if robot.scan is None or robot.scan_pose is None or received is None:
            return False
        if now.mono - received.mono > OLDEST_S / 2:
            return False
        _, last = self._handled.get(robot.robot_id, (0.0, None))
        return robot.scan is not last and now.mono - self._handled_at(robot) >= APART_S

    def _handled_at(self, robot: RobotState) -> float:
        return self._handled.get(robot.robot_id, (float("-inf"), None))[0]

    def _tell(self, robot: RobotState, now: Instant) -> None:
        waiting, pose, received = robot.scan, robot.scan_pose, robot.scan_received
        if waiting is None or pose is None or received is None:
            return
        self._handled[robot.robot_id] = now.mono, waiting
        scan = self._scans.newest(robot)
        if scan is None or not scan.ranges.size:
            return
        try:
            peer_scan = peer_scan_of(scan, pose, max(0.0, now.mono - received.mono))
        except Exception as error:
            # One robot's scan ends neither this part nor what others are told.
            self._scans.undrawable(robot.robot_id, error)
            return
        self._seq += 1
        origin = Origin(self._boot, self._seq, format_stamp(now.wall))
        self._publish(replace(peer_scan, origin=origin))


def _asks(robot: RobotState, now: Instant) -> bool:
    report = fresh_report(robot, now)
    return report is not None and report.peer_scans
