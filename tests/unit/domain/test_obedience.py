"""Obedience is what a robot was told, and how fast it was measured to drive then."""

from dataclasses import replace

import pytest

from iveg.domain.alerts import of_ignored_limit
from iveg.domain.feedback import CLEAR, HALF_SPEED, SpeedLimit
from iveg.domain.robot_state import Obedience, allowed_s
from iveg.domain.world import World
from tests.builders import AGI, at, fleet_of, odometry, origin, received, safety_report

PERSON = SpeedLimit(HALF_SPEED, "person", "P1", 1.2, "d-1")
STEP_S = 0.1


class Watched:
    """AGI, ten messages a second, and what it was told."""

    def __init__(self, *, reports: float | None = None) -> None:
        self.world, self.obedience = World(fleet_of("AGI")), Obedience()
        self.reports, self.now, self.x, self.seq = reports, 0.0, 5.0, 0

    def drive(
        self,
        seconds: float,
        limit: SpeedLimit,
        *,
        speed: float = 0.8,
        twist: float | None = None,
        late_s: float = 0.0,
    ) -> list[str]:
        """Keys of the alerts that held meanwhile."""
        found = list[str]()
        for _ in range(round(seconds / STEP_S)):
            self.now, self.seq = round(self.now + STEP_S, 6), self.seq + 1
            self.x += speed * STEP_S
            self.obedience.published({"AGI": limit}, at(self.now))
            name = origin(self.seq, after=self.now - late_s)
            said = odometry(
                x=self.x, linear=speed if twist is None else twist, origin=name
            )
            self.world.apply(received(said, after=self.now))
            if self.reports is not None:
                report = safety_report("AGI", speed_factor=self.reports, origin=name)
                self.world.apply(received(report, after=self.now))
            robot = self.world.robot("AGI")
            ignored = self.obedience.ignored(robot, at(self.now))
            found += [one.key for one in of_ignored_limit("AGI", ignored)]
        return found


@pytest.mark.parametrize("reports", [None, 0.5, 1.0])
def test_a_robot_that_drives_on_is_told_of_whatever_it_reports(
    reports: float | None,
) -> None:
    watched = Watched(reports=reports)
    watched.drive(3.0, CLEAR)

    early = watched.drive(allowed_s(AGI), PERSON)
    late = watched.drive(0.3, PERSON)

    assert early == []
    assert "alert.person_not_slowing" in late


def test_a_robot_whose_wheels_say_rest_is_judged_by_its_poses() -> None:
    assert Watched().drive(4.0, PERSON, twist=0.0)


def test_a_limit_whose_cause_changes_goes_on() -> None:
    watched, found = Watched(), list[str]()

    for number in range(8):
        found += watched.drive(0.5, replace(PERSON, cause=f"P{number}"))

    assert found[0] == "alert.person_not_slowing"


@pytest.mark.parametrize("speed", [0.0, 0.3, 0.5])
def test_a_robot_that_is_slow_or_stands_is_never_disobedient(speed: float) -> None:
    assert Watched().drive(20.0, PERSON, speed=speed) == []


def test_a_moment_of_speed_is_no_disobedience() -> None:
    watched = Watched()
    watched.drive(3.0, PERSON, speed=0.5)

    assert watched.drive(0.3, PERSON, speed=0.5, twist=0.8) == []
