"""Why robots drove slowly, and whether near people: seconds, beside the rule loop.

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
    """Seconds in which a robot moved and said that it was limited, since the start.

    Of those in which it moved with somebody in sight within two metres, whether it was
    slow, is counted apart: by what iVeg itself knows, which is less than the truth.
    """

    def __init__(self, world: World, people: People) -> None:
        self._world = world
        self._people = people
        self._spent: defaultdict[str, float] = defaultdict(float)
        self._near = {"slow": 0.0, "fast": 0.0}
        self._at: float | None = None

    @property
    def seconds(self) -> dict[str, int]:
        """Whole ones, by cause: ``memory``, or the reason that the robot reported."""
        return {why: int(spent_s) for why, spent_s in self._spent.items()}

    @property
    def near(self) -> dict[str, int]:
        """Whole seconds near somebody who is seen: ``slow`` and ``fast``."""
        return {how: int(spent_s) for how, spent_s in self._near.items()}

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
            if not robot.stands and self._is_near(robot, now):
                self._near["fast" if why is None else "slow"] += past

    def _is_near(self, robot: RobotState, now: Instant) -> bool:
        if robot.odometry is None:
            return False
        distance_to = robot.odometry.pose.distance_to
        return any(
            one.class_ == "person"
            and one.age_s(now) <= LIMITS.seen_s
            and distance_to(one.newest.x, one.newest.y) <= LIMITS.ring_default_m
            and self._people.things.explain(one, now) is None
            for one in self._people.known.values()
        )

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
