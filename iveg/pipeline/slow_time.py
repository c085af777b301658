"""Why robots drove slowly: seconds by cause, beside the rule loop, for people.

*Memory* is the ring of a person who was not seen for a second: where nobody looks, it
grows, and most of the time that robots crawl with nobody near is this.
"""

from collections import defaultdict

from iveg.domain.feedback import HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.world import World

_EVERY_S = 0.5
_LONGEST_S = 1.0
"""An evaluation after a longer silence does not stand for all of it."""


class SlowTime:
    """Seconds in which a robot moved and said that it was limited, since the start."""

    def __init__(self, world: World, people: People) -> None:
        self._world = world
        self._people = people
        self._spent: defaultdict[str, float] = defaultdict(float)
        self._at: float | None = None

    @property
    def seconds(self) -> dict[str, int]:
        """Whole ones, by cause: ``memory``, or the reason that the robot reported."""
        return {why: int(spent_s) for why, spent_s in self._spent.items()}

    def tick(self, now: Instant) -> None:
        """Let time pass; it is counted twice a second."""
        before = now.mono if self._at is None else self._at
        if self._at is not None and now.mono - before < _EVERY_S - 1e-3:
            return
        self._at, past = now.mono, min(now.mono - before, _LONGEST_S)
        for robot in self._world.live_robots():
            why = self._why(robot, now)
            if why is not None:
                self._spent[why] += past

    def _why(self, robot: RobotState, now: Instant) -> str | None:
        """Why a robot drives slowly now; None where it does not, or nobody knows."""
        report, heard = robot.safety, robot.safety_received
        if report is None or heard is None or robot.stands:
            return None
        is_old = now.mono - heard.mono > LIMITS.report_stale_s
        if is_old or not 0.0 < report.speed_factor <= HALF_SPEED:
            return None
        return "memory" if self._is_memory(report, now) else report.reason

    def _is_memory(self, report: SafetyReport, now: Instant) -> bool:
        person = self._people.known.get(report.cause or "")
        return person is not None and person.age_s(now) > LIMITS.seen_s
