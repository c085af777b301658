"""Totals of the day's margins, beside the rule loop: shown and never acted on."""

from iveg.domain.exposure import Exposures
from iveg.domain.limits import LIMITS
from iveg.domain.margins import LeastMargins
from iveg.domain.observations import Instant
from iveg.domain.tracking.people import People
from iveg.domain.world import World


class MarginTotals:
    """For how long some margin was negative today, and the least of all.

    Attributes:
        exposures: The totals.
    """

    def __init__(self, world: World, people: People) -> None:
        self.exposures = Exposures()
        self._world = world
        self._people = people

    def tick(self, now: Instant) -> None:
        """Let time pass; margins are computed when they are due."""
        if not self.exposures.due(now):
            return
        fleet = list(self._world.live_robots())
        margins = LeastMargins(fleet, self._people.known.values(), now).telling()
        ages = [robot.age_s(now) for robot in fleet]
        seen = any(age is not None and age <= LIMITS.pose_lost_s for age in ages)
        self.exposures.update(margins, now, seen=seen)
