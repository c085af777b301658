"""Maps beside the rule loop: costmaps of scans, scans for peers, camera coverage.

No robot stops for any of them.  A scan costs about as much as a hundred decisions, so
one at a time is drawn, the newest of the robot that has waited longest; a
fleet that sends more is drawn less often.
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
"""Between two scans that are drawn or handed on, and two looks of all cameras."""
APART_S = 0.5
"""Between two scans of one robot for peers (s), at least."""
_PERIOD_S = 0.25
_WIDEST_M = 1000.0
"""Longer than any greenhouse: an open field, mapped in a window round the robots."""


class _Turns:
    """Turns of robots by their scans: the one that has waited longest is next.

    Args:
        apart_s: Between two scans of one robot (s), at least.
    """

    def __init__(self, apart_s: float) -> None:
        self._apart_s = apart_s
        self._taken: dict[str, tuple[float, LaserScan]] = {}

    def next(self, robots: Iterable[RobotState], now: Instant) -> RobotState | None:
        """Take the turn of a robot with a new scan; None: none is due."""
        due = [robot for robot in robots if self._is_due(robot, now)]
        robot = min(due, key=self._at, default=None)
        if robot is not None and robot.scan is not None:
            self._taken[robot.robot_id] = now.mono, robot.scan
        return robot

    def newest_at(self, robot_id: str | None) -> float | None:
        """The newest turn of a robot, or of any (monotonic, s); None: never."""
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
    """

    def __init__(self, world: World, bounds: Rectangle) -> None:
        self._world = world
        wide = max(bounds.xmax - bounds.xmin, bounds.ymax - bounds.ymin)
        self._is_open = wide > _WIDEST_M
        self._grid = None if self._is_open else Grid.over(bounds)
        # By robot; the fleet shares that of None.
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
        """Since the newest scan of one robot, or of any, was drawn (s); None: never."""
        at = self._turns.newest_at(robot_id)
        return None if at is None else now.mono - at

    def of(
        self, robot_id: str, zones: Iterable[Zone], now: Instant
    ) -> InflatedGrid | None:
        """Costmap of one robot: its own scans, people and peers of its feedback."""
        others = [zone for zone in zones if zone.cause != robot_id]
        return _costs(self._drawn.get(robot_id), others, now)

    def _draw(self, robot: RobotState, now: Instant) -> None:
        self._place()
        scan, pose = robot.scan, robot.scan_pose
        if scan is None or pose is None or self._grid is None:
            return
        sweep = sweep_of(scan, pose, self._grid)
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
        publish: Takes what is told.
        boot: Of iVeg, as in feedback.
    """

    def __init__(
        self, world: World, publish: Callable[[PeerScan], None], boot: str
    ) -> None:
        self._world, self._publish = world, publish
        self._boot, self._seq = boot, 0
        self._turns = _Turns(APART_S)

    def tick(self, now: Instant) -> None:
        """Hand on the scan of the robot that has waited longest, if one is due."""
        robots = [*self._world.live_robots()]
        asking = {robot.robot_id for robot in robots if _asks(robot, now)}
        robot = self._turns.next(
            (
                one
                for one in robots
                if asking - {one.robot_id} and _age_s(one, now) <= OLDEST_S / 2
            ),
            now,
        )
        if robot is not None:
            self._publish_scan(robot, now)

    def _publish_scan(self, robot: RobotState, now: Instant) -> None:
        scan, pose = robot.scan, robot.scan_pose
        if scan is None or pose is None or not scan.ranges.size:
            return
        peer_scan = peer_scan_of(scan, pose, max(0.0, _age_s(robot, now)))
        self._seq += 1
        origin = Origin(self._boot, self._seq, format_stamp(now.wall))
        self._publish(replace(peer_scan, origin=origin))


def _age_s(robot: RobotState, now: Instant) -> float:
    """Since a robot's newest scan came (s); infinite before the first."""
    received = robot.scan_received
    return float("inf") if received is None else now.mono - received.mono


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
