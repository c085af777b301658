"""The last STOP drill of each robot, and whether the next one is due.

A robot that was never drilled is not reminded of: a site begins the habit with its
first drill, and from then on a missing drill is a fact.
"""

from collections.abc import Iterable, Mapping

from iveg.domain.events import Condition
from iveg.domain.observations import Instant

_DAY_S = 86_400.0


class Drills:
    """The last drill of each robot that ended in a measured standstill.

    Args:
        days: A drill is due after so many days; 0 reminds nobody.
    """

    def __init__(self, days: float = 0.0) -> None:
        self._days = days
        self.last: dict[str, float] = {}

    def remember(self, drilled: Mapping[str, float]) -> None:
        """Drills of earlier runs: robot → Unix time (s)."""
        for robot_id, at in drilled.items():
            self.passed(robot_id, at)

    def passed(self, robot_id: str, at: float) -> None:
        """Note a drill that ended in a standstill."""
        self.last[robot_id] = max(at, self.last.get(robot_id, at))

    def conditions(self, now: Instant) -> Iterable[Condition]:
        """Conditions of robots whose last drill is older than the configured days."""
        for robot_id in due_drills(self.last, self._days, now.wall):
            days = int((now.wall - self.last[robot_id]) / _DAY_S)
            yield Condition.of_robot("P3", "alert.drill_due", robot_id, days=days)


def due_drills(last: Mapping[str, float], days: float, by: float) -> list[str]:
    """Robots whose last drill will be older than ``days`` at ``by`` (Unix s)."""
    if days <= 0:
        return []
    return sorted(robot for robot, at in last.items() if by - at > days * _DAY_S)
