"""Maps beside the rule loop: costmaps of scans, scans for peers, camera coverage.

No robot stops for a map.  A scan costs about as much as a hundred decisions, so
one at a time is drawn, the newest of the robot that has waited longest; a
fleet that sends more is drawn less often.  A scan that cannot be drawn is
refused with its reason, without any other effect.
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
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant, LaserScan, Origin
from iveg.domain.peer_scan import OLDEST_S, PeerScan, peer_scan_of
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.zones import Zone
from iveg.domain.stamps import format_stamp
from iveg.domain.tracking.sight import is_detecting
from iveg.domain.world import World

SCAN_TICK_S, COVERAGE_TICK_S = 0.05, 0.5
"""Time between two scans that are drawn or handed on, and two coverage updates (s)."""
APART_S = 0.5
"""Time between two scans of one robot for peers (s), at least."""
_PERIOD_S = 0.25
"""Time between two scans of one robot in the costmap (s), at least."""
_WIDEST_M = 1000.0
"""Longer side of the largest greenhouse (m); beyond it a window follows the robots."""
Reject = Callable[[str, str, str], None]


class _Turns:
    """Turns of robots by their scans: the robot that has waited longest is next.

    Args:
        apart_s: Time between two scans of one robot (s), at least.
    """

    def __init__(self, apart_s: float) -> None:
        self._apart_s = apart_s
        self._taken: dict[str, tuple[float, LaserScan]] = {}

    def next(self, robots: Iterable[RobotState], now: Instant) -> RobotState | None:
        """The robot whose new scan is due; its turn counts as taken.  None: none is."""
        due_robots = [robot for robot in robots if self._is_due(robot, now)]
        robot = min(due_robots, key=self._at, default=None)
        if robot is not None and robot.scan is not None:
            self._taken[robot.robot_id] = now.mono, robot.scan
        return robot

    def newest_at(self, robot_id: str | None) -> float | None:
        """Newest turn of a robot, or of any robot (monotonic, s); None: never."""
        names = self._taken if robot_id is None else {robot_id} & self._taken.keys()
        return max((self._taken[name][0] for name in names), default=None)

    def _is_due(self, robot: RobotState, now: Instant) -> bool:
        if robot.scan is None or robot.scan_pose is None:
            return False
        _, last = self._taken.get(robot.robot_id, (0.0, None))
        return robot.scan is not last and now.mono - self._at(robot) >= self._apart_s

    def _at(self, robot: RobotState) -> float:
        return self._taken.get(robot.robot_id, (float("-inf"), None))[0]


class Mapper:
    """One grid that the fleet shares, and one for each robot.

    Args:
        bounds: The outer wall of the greenhouse.
        reject: Counts a scan that cannot be drawn: robot, reason, detail.
    """

    def __init__(self, world: World, bounds: Rectangle, reject: Reject) -> None:
        self._world, self._reject = world, reject
        wide = max(bounds.xmax - bounds.xmin, bounds.ymax - bounds.ymin)
        self._is_open = wide > _WIDEST_M
        self._grid = None if self._is_open else Grid.over(bounds)
        # Key: robot; None is the grid that the fleet shares.
        self._drawn: dict[str | None, Occupancy] = {}
        self._turns = _Turns(_PERIOD_S)

    def tick(self, now: Instant) -> None:
        """Take in the scan that has waited longest, if one is due."""
        robot = self._turns.next(self._world.live_robots(), now)
        if robot is not None:
            self._draw(robot, now)

    def shared(self, zones: Iterable[Zone], now: Instant) -> InflatedGrid | None:
        """The fleet's costmap; None before the first scan."""
        return _costs(self._drawn.get(None), zones, now)

    def age_s(self, robot_id: str | None, now: Instant) -> float | None:
        """Age of the newest drawn scan, of a robot or of any (s); None: never."""
        at = self._turns.newest_at(robot_id)
        return None if at is None else now.mono - at

    def of_robot(
        self, robot_id: str, zones: Iterable[Zone], now: Instant
    ) -> InflatedGrid | None:
        """Costmap of one robot: its own scans, people and peers of its feedback."""
        # Its own zone would surround the robot with cost wherever it goes.
        others = [zone for zone in zones if zone.cause != robot_id]
        return _costs(self._drawn.get(robot_id), others, now)

    def _draw(self, robot: RobotState, now: Instant) -> None:
        self._place()
        scan, pose = robot.scan, robot.scan_pose
        if scan is None or pose is None or self._grid is None:
            return
        try:
            sweep = sweep_of(scan, pose, self._grid)
        except Exception as error:
            # One robot's scan must end neither this part nor the drawing of others.
            self._reject(robot.robot_id, "undrawable_scan", repr(error))
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
    # First fade, so that the new sweep counts in full.
    occupancy.fade(now.mono)
    occupancy.add(sweep)
    return occupancy


def _costs(
    occupancy: Occupancy | None, zones: Iterable[Zone], now: Instant
) -> InflatedGrid | None:
    if occupancy is None:
        return None
    occupancy.fade(now.mono)
    # Zones of a replay lie in the map of its recording, not in ours.
    return occupancy.costs(zone for zone in zones if zone.recording is None)


class PeerScans:
    """Hands scans on while any robot asks for them in its safety report.

    Never two in one turn, so that no feedback waits behind a burst.

    Args:
        reject: Counts a scan that cannot be drawn: robot, reason, detail.
        publish: Sends a scan to the robots that asked.
        boot: Boot of iVeg, as in its feedback.
    """

    def __init__(
        self,
        world: World,
        reject: Reject,
        publish: Callable[[PeerScan], None],
        boot: str,
    ) -> None:
        self._world, self._reject, self._publish = world, reject, publish
        self._boot, self._seq = boot, 0
        self._turns = _Turns(APART_S)

    def tick(self, now: Instant) -> None:
        """Hand on the scan of the robot that has waited longest, if one is due."""
        robots = [*self._world.live_robots()]
        asking = {robot.robot_id for robot in robots if _asks(robot, now)}
        # Only where another robot asks; half of the age that readers accept is left
        # for the way to them.
        robot = self._turns.next(
            (
                robot
                for robot in robots
                if asking - {robot.robot_id} and _age_s(robot, now) <= OLDEST_S / 2
            ),
            now,
        )
        if robot is not None:
            self._publish_scan(robot, now)

    def _publish_scan(self, robot: RobotState, now: Instant) -> None:
        scan, pose = robot.scan, robot.scan_pose
        if scan is None or pose is None or not scan.ranges.size:
            return
        try:
            peer_scan = peer_scan_of(scan, pose, max(0.0, _age_s(robot, now)))
        except Exception as error:
            # One robot's scan must end neither this part nor the scans of others.
            self._reject(robot.robot_id, "undrawable_scan", repr(error))
            return
        self._seq += 1
        origin = Origin(self._boot, self._seq, format_stamp(now.wall))
        self._publish(replace(peer_scan, origin=origin))


def _age_s(robot: RobotState, now: Instant) -> float:
    """Age of a robot's newest scan, since it came (s); infinite before the first."""
    received = robot.scan_received
    return float("inf") if received is None else now.mono - received.mono


def _asks(robot: RobotState, now: Instant) -> bool:
    report = fresh_report(robot, now)
    return report is not None and report.peer_scans


class CoverageMonitor:
    """Moments at which each cell of the aisles was last in view.

    Attributes:
        coverage: The cells, each with that moment.
    """

    def __init__(self, world: World, greenhouse: Greenhouse) -> None:
        self._world = world
        self.coverage = AisleCoverage(greenhouse)

    def tick(self, now: Instant) -> None:
        """Take in what the cameras have in view now."""
        self.coverage.update(self._world.live_robots(), now)

    def cameras(self, now: Instant) -> int:
        """Number of cameras that work now."""
        return sum(is_detecting(robot, now) for robot in self._world.live_robots())
