"""Maps beside the rule loop: costmaps of scans, scans for peers, camera coverage.

No robot stops for any of them.  A scan costs about as much as a hundred decisions, so
one at a time is read and drawn, the newest of the robot that has waited longest; a
fleet that sends more is drawn less often.  A scan that cannot be read or drawn is
refused with its reason, and nothing else notices.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

from iveg.comfort.situations import fresh_report
from iveg.domain.costmap import (
    Grid,
    InflatedGrid,
    Occupancy,
    Sweep,
    sweep_of,
    window_round,
)
from iveg.domain.coverage import AisleCoverage
from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant, LaserScan, Origin, UnreadScan
from iveg.domain.peer_scan import OLDEST_S, PeerScan, peer_scan_of
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.zones import Zone
from iveg.domain.stamps import format_stamp
from iveg.domain.tracking.sight import is_detecting
from iveg.domain.world import World

SCAN_TICK_S, COVERAGE_TICK_S = 0.05, 0.5
"""Between two scans that are drawn or handed on, and two looks of all cameras."""
APART_S = 0.5
"""Between two scans of one robot for peers (s), at least."""
_PERIOD_S = 0.25
_WIDEST_M = 1000.0
"""Longer than any greenhouse: an open field, mapped in a window round the robots."""
Reject = Callable[[str, str, str], None]


class ScanReader:
    """The newest scan of each robot, read when it is first asked for.

    Args:
        reject: Told of a scan that is refused: robot, reason, detail.
    """

    def __init__(self, reject: Reject) -> None:
        self.reject = reject
        self._read: dict[str, tuple[UnreadScan, LaserScan | None]] = {}

    def newest(self, robot: RobotState) -> LaserScan | None:
        """A robot's newest scan; None where there is none that can be read."""
        scan = robot.scan
        if scan is None or isinstance(scan, LaserScan):
            return scan
        known = self._read.get(robot.robot_id)
        if known is None or known[0] is not scan:
            known = self._read[robot.robot_id] = scan, self._of(scan)
        return known[1]

    def undrawable(self, robot_id: str, error: Exception) -> None:
        """Refuse a scan that was read and cannot be drawn."""
        self.reject(robot_id, "undrawable_scan", repr(error))

    def _of(self, scan: UnreadScan) -> LaserScan | None:
        try:
            return scan.read()
        except UnreadableError as error:
            self.reject(scan.robot_id, error.reason, error.detail)
        except Exception as error:
            self.reject(scan.robot_id, "unreadable_scan", repr(error))
        return None


class Mapper:
    """One grid that the fleet shares, and one for each robot.

    Args:
        bounds: The outer wall of the greenhouse.
        scans: Reads them.
    """

    def __init__(self, world: World, bounds: Rectangle, scans: ScanReader) -> None:
        self._world, self._scans = world, scans
        wide = max(bounds.xmax - bounds.xmin, bounds.ymax - bounds.ymin)
        self._is_open = wide > _WIDEST_M
        self._grid = None if self._is_open else Grid.over(bounds)
        # By robot; the fleet shares that of None.
        self._drawn: dict[str | None, Occupancy] = {}
        self._read: dict[str, LaserScan | UnreadScan] = {}
        self._read_at: dict[str, float] = {}

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


class PeerScans:
    """Hands scans on while any robot asks in its safety report.

    Never two in one turn, so that no feedback waits behind a burst.

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


class CoverageMonitor:
    """When each cell of the aisles was last in view.

    Attributes:
        coverage: What was looked at, and when.
    """

    def __init__(self, world: World, greenhouse: Greenhouse) -> None:
        self._world = world
        self.coverage = AisleCoverage(greenhouse)

    def tick(self, now: Instant) -> None:
        """Take in what the cameras have in view now."""
        self.coverage.update(self._world.live_robots(), now)

    def cameras(self, now: Instant) -> int:
        """Number of cameras that work now, wherever they are."""
        return sum(is_detecting(robot, now) for robot in self._world.live_robots())
