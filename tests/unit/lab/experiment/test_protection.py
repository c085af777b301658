"""Protection on worlds made by hand: who was near, in view, slowed, and how late."""

from typing import Any

import pytest

from iveg.lab.experiment.protection import (
    NearMoment,
    NearPerson,
    Protection,
    Sight,
    moments_of,
    protection_of,
)

STEP_S = 0.5


def score_of(*moments: NearMoment) -> Protection:
    return protection_of(moments)


def moment(
    step: int,
    distance_m: float = 1.0,
    *,
    factor: float = 1.0,
    speed: float = 0.6,
    wanted: float = 0.8,
    sight: Sight = "in_view",
    foretold: bool = False,
    robot_id: str = "AGI",
) -> NearMoment:
    people = (NearPerson("p", distance_m, sight, foretold),)
    at = step * STEP_S
    return NearMoment(robot_id, at, STEP_S, speed, wanted, factor, people)


def test_a_person_in_the_zone_of_a_robot_at_half_speed_is_protected() -> None:
    score = score_of(moment(0, factor=0.5), moment(1, factor=0.0))

    assert (score.near_s["in_view"], score.slowed_s["in_view"]) == (1.0, 1.0)
    assert score.row()["slowed"]["in_view"] == 1.0
    assert score.row()["never_slowed"] == 0


def test_the_delay_is_from_the_zone_and_the_view_to_the_limit() -> None:
    score = score_of(
        moment(0, 3.0),
        moment(1, 1.9, sight="unseen"),
        moment(2, 1.8),
        moment(3, 1.7),
        moment(4, 1.6, factor=0.5),
    )

    assert score.delays_s == [1.0]
    assert score.near_s == {"in_view": 1.5, "unseen": 0.5}


def test_whom_no_camera_has_counts_apart_and_is_no_encounter() -> None:
    score = score_of(moment(0, sight="unseen"), moment(1, sight="unseen", factor=0.5))

    slowed = score.row()["slowed"]
    assert (slowed["unseen"], slowed["all"], slowed["in_view"]) == (0.5, 0.5, None)
    assert score.delays_s == []


def test_a_robot_that_stands_endangers_nobody() -> None:
    score = score_of(moment(0, speed=0.0), moment(1, speed=0.04))

    assert (score.driven_s, sum(score.near_s.values()), score.delays_s) == (
        0.0,
        0.0,
        [],
    )


@pytest.mark.parametrize(
    ("distance_m", "needless"), [(2.4, 0.0), (3.9, 0.0), (4.1, 1.0)]
)
def test_slow_with_nobody_within_four_metres_is_needless(
    distance_m: float, needless: float
) -> None:
    assert score_of(moment(0, distance_m, factor=0.5)).row()["needless"] == needless


# --- entries --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("told_at", "foretold_s"),
    [
        ((1, 2, 3), 1.5),
        ((2, 3), 1.0),
        ((), None),
        # A gap of a second is none; a longer one begins anew, or ends it.
        ((0, 2), 2.0),
        ((0, 3), 0.5),
        ((0, 1), None),
    ],
)
def test_an_entry_was_foretold_since_iveg_told_of_it_without_a_break(
    told_at: tuple[int, ...], foretold_s: float | None
) -> None:
    before = [moment(step, 3.0, foretold=step in told_at) for step in range(4)]

    score = score_of(*before, moment(4, 1.9, foretold=True))

    assert score.foretold_s == [foretold_s]
    share = score_of(*before, moment(4, 1.9)).row()["foretold"]
    assert share == float((foretold_s or 0.0) >= 1.5)


@pytest.mark.parametrize("sight", ["in_view", "unseen"])
def test_an_entry_of_somebody_in_view_for_less_than_two_seconds_is_none(
    sight: Sight,
) -> None:
    hidden = [moment(step, 3.0, sight="unseen") for step in range(3)]

    score = score_of(*hidden, moment(3, 3.0), moment(4, 1.9, sight=sight))

    assert score.foretold_s == []


# --- worlds as files have them --------------------------------------------------------


def row(
    robot: str, at: float, x: float, seen: tuple[str, ...] = (), **more: Any
) -> Any:
    """A robot at (x, 0) among p at (0, 0) and q at (0, 1)."""
    return {
        "robot": robot,
        "at": at,
        "pose": {"x": x, "y": 0.0, "yaw": 0.0},
        "speed": -0.5,
        "wanted": 1.0,
        "factor": 0.5,
        "visible": [{"key": key} for key in seen],
        "people": [
            {"key": "p", "x": 0.0, "y": 0.0},
            {"key": "q", "x": 0.0, "y": 1.0},
        ],
        **more,
    }


def test_rows_of_the_truth_become_moments_with_what_any_camera_sees() -> None:
    truth = [row("AGII", 0.1, 9.0, ("q",)), row("AGI", 0.1, 1.0), row("AGI", 0.2, 1.0)]

    last = list(moments_of(truth))[-1]

    assert (last.robot_id, last.at, last.speed, last.wanted) == ("AGI", 0.2, 0.5, 1.0)
    assert last.lasts_s == pytest.approx(0.1)
    assert [(one.name, one.sight) for one in last.people] == [
        ("p", "unseen"),
        ("q", "in_view"),
    ]
    assert [one.distance_m for one in last.people] == pytest.approx([1.0, 2**0.5])


@pytest.mark.parametrize(
    ("x", "y", "foretold"), [(0.3, 0.1, ["p"]), (0.3, 0.9, ["q"]), (3.0, 0.0, [])]
)
def test_what_was_foretold_is_of_the_person_who_really_is_there(
    x: float, y: float, foretold: list[str]
) -> None:
    told = [{"robot": "AGI", "at": 0.1, "people": [{"x": x, "y": y}]}]

    here, there = moments_of([row("AGI", 0.1, 5.0), row("AGII", 0.1, 5.0)], told)

    assert [one.name for one in here.people if one.has_encounter] == foretold
    assert not any(one.has_encounter for one in there.people)
