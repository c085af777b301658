"""Protection on worlds made by hand: who was near, in view, slowed, and how late."""

import pytest

from iveg.lab.experiment.protection import (
    Moment,
    NearPerson,
    ProtectionScore,
    whole,
)

STEP_S = 0.5


def score_of(*moments: Moment) -> ProtectionScore:
    score = ProtectionScore(STEP_S)
    for moment in moments:
        score.add(moment)
    return score


def moment(
    step: int,
    distance_m: float = 1.0,
    *,
    factor: float = 1.0,
    speed: float = 0.6,
    wanted: float = 0.8,
    in_view: bool = True,
    robot_id: str = "AGI",
) -> Moment:
    person = NearPerson("p", distance_m, in_view)
    return Moment(robot_id, step * STEP_S, speed, wanted, factor, (person,))


def test_a_person_in_the_ring_of_a_robot_at_half_speed_is_protected() -> None:
    score = score_of(moment(0, factor=0.5), moment(1, factor=0.0))

    assert (score.view_s, score.view_slowed_s, score.never_slowed) == (1.0, 1.0, 0)
    assert score.row()["slowed, in view"] == 1.0


def test_a_robot_at_full_speed_protects_nobody() -> None:
    score = score_of(moment(0), moment(1), moment(2))

    assert score.row()["slowed, in view"] == 0.0
    assert (len(score.encounters), score.never_slowed) == (1, 1)


def test_the_delay_is_from_the_ring_and_the_view_to_the_limit() -> None:
    score = score_of(
        moment(0, 3.0),
        moment(1, 1.9, in_view=False),
        moment(2, 1.8),
        moment(3, 1.7),
        moment(4, 1.6, factor=0.5),
    )

    assert [one.delay_s for one in score.encounters] == [1.0]
    assert (score.near_s, score.view_s) == (2.0, 1.5)


def test_whom_no_camera_has_counts_among_all_and_is_no_encounter() -> None:
    score = score_of(moment(0, in_view=False), moment(1, in_view=False, factor=0.5))

    assert score.row()["slowed, all"] == 0.5
    assert score.row()["slowed, in view"] is None
    assert score.encounters == []


def test_a_robot_that_stands_endangers_nobody() -> None:
    score = score_of(moment(0, speed=0.0), moment(1, speed=0.04))

    assert (score.driven_s, score.near_s, score.encounters) == (0.0, 0.0, [])


@pytest.mark.parametrize(
    ("distance_m", "at_the_ring", "far"),
    [(2.2, 0.0, 0.0), (2.4, 1.0, 0.0), (4.1, 1.0, 1.0)],
)
def test_slow_with_nobody_near_is_needless(
    distance_m: float, at_the_ring: float, far: float
) -> None:
    row = score_of(moment(0, distance_m, factor=0.5)).row()

    assert (row["needless > 2.3 m"], row["needless > 4 m"]) == (at_the_ring, far)


def test_an_encounter_goes_on_through_a_second_and_begins_anew_after_it() -> None:
    score = score_of(moment(0), moment(2), moment(5))

    assert [one.began for one in score.encounters] == [0.0, 2.5]


def test_two_robots_near_one_person_are_two_encounters() -> None:
    score = score_of(moment(0), moment(0, robot_id="AGII", factor=0.5))

    assert (len(score.encounters), score.never_slowed) == (2, 1)


def test_metres_and_delays_of_several_runs_add_up() -> None:
    one = score_of(moment(0), moment(1, factor=0.5))
    other = score_of(moment(0, factor=0.5))

    total = whole([one, other]).row()

    assert total["driven m"] == pytest.approx(0.9)
    assert total["encounters"] == 2
    assert total["slowed, all"] == pytest.approx(2 / 3, 1e-3)
    assert (total["delay P50 s"], total["delay P95 s"]) == (0.25, 0.475)


@pytest.mark.parametrize(
    ("speed", "wanted", "share"), [(0.4, 0.8, 1.0), (0.45, 0.8, 0.0), (0.8, 0.8, 0.0)]
)
def test_a_ring_is_entered_slowly_at_half_of_the_wanted_speed(
    speed: float, wanted: float, share: float
) -> None:
    score = score_of(
        *(moment(step, 3.0) for step in range(4)),
        moment(4, 1.9, speed=speed, wanted=wanted),
        moment(5, 1.0),
    )

    row = score.row()
    assert (row["entries"], row["slow at the ring"]) == (1, share)


def test_who_steps_out_or_was_inside_already_is_no_entry() -> None:
    hidden = [moment(step, 3.0, in_view=step == 3) for step in range(4)]
    for before in (hidden, [moment(step, 1.9) for step in range(4)]):
        assert score_of(*before, moment(4, 1.5)).row()["entries"] == 0


def test_a_robot_that_wants_to_stand_enters_nothing() -> None:
    score = score_of(
        *(moment(step, 3.0) for step in range(5)), moment(5, 1.5, wanted=0)
    )
    assert score.row()["entries"] == 0
