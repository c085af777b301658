"""A robot slows by its own odometry before it reaches somebody's ring."""

from itertools import pairwise

import pytest

from iveg.domain.feedback import FeedbackAlert
from iveg.domain.fleet import CAUTIOUS
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.limits import LIMITS
from iveg.domain.rule.paths import slows_within_s
from iveg.robot.caps import Cap
from iveg.robot.lookahead import Lookahead
from tests.unit.robot.rig import STEP_S, Rig, person

STILL = (0.0, 0.0)


def driving(*alerts: FeedbackAlert, foresight: bool = True, speed: float = 1.0) -> Rig:
    """At the origin, straight ahead; iVeg itself limits nothing."""
    rig = Rig(foresight=foresight, alerts=()).drive_on()
    rig.wished, rig.alerts = Twist2D(speed, 0.0), alerts
    rig.run(1.5)
    return rig


def slowed_at(rig: Rig, path: tuple[tuple[float, float], ...] = ()) -> float | None:
    """Where it is first limited on its way along x, up to 5 m; None: nowhere."""
    while rig.pose.x < 5.0:
        if path:
            rig.machine.note_path(path, rig.now)
        rig.step()
        if rig.factor < 1.0:
            return rig.pose.x
        x = rig.pose.x + rig.speed.linear_x * STEP_S
        rig.pose = Pose2D(round(x, 6), 0.0, 0.0)
    return None


def test_it_is_slow_at_the_ring_and_names_the_person() -> None:
    rig = driving(person(6.5, velocity=STILL))
    x = slowed_at(rig)
    # The ring begins at 4.5; it looks five times a second.
    soon = 4.5 - 1.0 * slows_within_s(CAUTIOUS.braking, 1.0)
    assert x == pytest.approx(soon + 0.1, abs=0.2)
    assert (rig.factor, rig.reason) == (0.5, "person")
    assert rig.machine.cap.decision_id == "d-1"


@pytest.mark.parametrize(
    ("alert", "foresight"),
    [(person(6.5, velocity=STILL), False), (person(6.5), True)],
    ids=["the rule does not", "nobody knows how they go on"],
)
def test_without_a_forecast_the_ring_counts_as_before(
    alert: FeedbackAlert, foresight: bool
) -> None:
    x = slowed_at(driving(alert, foresight=foresight))
    assert x == pytest.approx(4.5, abs=0.06)


def test_it_needs_no_network_while_what_it_was_told_is_young() -> None:
    rig = driving(person(4.0, velocity=STILL), speed=0.3)
    assert rig.factor == 1.0
    rig.speaks, rig.speed = False, Twist2D(1.0, 0.0)
    rig.obeys = False
    rig.run(0.4)
    rig.pose = Pose2D(1.4, 0.0, 0.0)
    rig.run(0.3)
    assert (rig.factor, rig.reason) == (0.5, "person")


def test_who_walks_away_slows_nobody_and_who_comes_sooner() -> None:
    away = slowed_at(driving(person(3.0, velocity=(1.4, 0.0))))
    comes = slowed_at(driving(person(6.5, velocity=(-1.0, 0.0))))
    stays = slowed_at(driving(person(6.5, velocity=STILL)))
    assert away is None or away > 0.9, "the circle itself, as before"
    assert comes is not None
    assert stays is not None
    assert comes < stays


def test_its_own_plan_turns_away_before_the_ring() -> None:
    corner = ((0.0, 0.0), (2.2, 0.0), (2.2, -9.0))
    rig = driving(person(6.5, velocity=STILL))
    ahead = slowed_at(rig)
    rig = driving(person(5.4, velocity=STILL))
    rig.pose = Pose2D(1.5, 0.0, 0.0)
    rig.machine.note_path(corner, rig.now)
    rig.run(0.6)
    assert ahead is not None
    assert rig.factor == 1.0, "it will have turned the corner"


def test_it_is_lifted_a_second_after_the_encounter_is_gone() -> None:
    rig = driving(person(6.5, velocity=STILL))
    assert slowed_at(rig) is not None
    rig.alerts = (person(6.5, 9.0, velocity=STILL),)
    rig.hear()
    gone = rig.now
    while rig.factor < 1.0:
        rig.step()
    assert rig.now - gone == pytest.approx(1.2, abs=0.2)


def test_a_robot_without_a_place_foresees_nothing_and_stands() -> None:
    rig = driving(person(6.5, velocity=STILL))
    rig.odometry = False
    rig.run(1.0)
    assert (rig.factor, rig.reason) == (0.0, "stale")


def test_behind_somebody_who_walks_ahead_it_does_not_speed_up_and_brake_in_turns() -> (
    None
):
    lookahead, cap = Lookahead(braking=1.0), Cap(0.5, "person")
    gap, drives, last, factor, changes = 6.0, 1.0, -9.0, 1.0, []
    for step in range(200):
        now, before = 0.2 * step, factor
        ahead = (gap, 0.0, 0.7, 0.0, 0.0, 2.0), cap
        lookahead.look(Pose2D(0.0, 0.0, 0.0), Twist2D(drives, 0.0), [ahead], now)
        last = now if lookahead.cap.factor < 1.0 else last
        factor = 0.5 if now - last < LIMITS.release_after_s else 1.0
        changes += [now] if factor != before else []
        drives += min(0.1, max(-0.1, factor - drives))
        gap += (0.7 - drives) * 0.2

    assert len(changes) > 3
    assert min(after - before for before, after in pairwise(changes)) > 2.5
