"""Reads scans for whoever needs them: once each, and only when somebody asks.

A scan is a list of numbers that eyes, the costmap and the all-clear need.  One that
cannot be read or drawn is refused with its reason, and nothing else notices.
"""

from collections.abc import Callable

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import LaserScan, UnreadScan
from iveg.domain.robot_state import RobotState

Reject = Callable[[str, str, str], None]


class ScanReader:
    """The newest scan of each robot, read when it is first asked for.

    Args:
        reject: Told of a scan that is refused: robot, reason, detail.
    """

    def __init__(self, reject: Reject = lambda *_: None) -> None:
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
