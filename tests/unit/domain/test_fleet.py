import pytest

from iveg.adapters.fleet_files import built_in
from iveg.domain.fleet import (
    CAUTIOUS,
    FleetDescription,
    RobotDescription,
    as_counted,
    split_word,
)


def test_nobody_whom_iveg_describes_is_larger_or_brakes_worse_than_the_unknown() -> (
    None
):
    for one in built_in().members.values():
        known = one.profile
        assert known.length <= CAUTIOUS.length
        assert known.width <= CAUTIOUS.width
        assert known.assumed_braking >= CAUTIOUS.assumed_braking
        assert known.camera_range <= CAUTIOUS.camera_range


def test_a_robot_outside_the_fleet_is_one_that_nobody_described() -> None:
    assert FleetDescription().of_robot("X1") == RobotDescription("X1")
    assert not FleetDescription().of_robot("X1").is_described


def test_names_of_robots_are_sorted_as_people_count() -> None:
    counted = ["AGI", "AGII", "R1", "R2", "R2b", "R10", "bay2-R3", "bay10-R1"]
    assert sorted(sorted(counted), key=as_counted) == counted


@pytest.mark.parametrize(
    ("word", "read"),
    [
        ("AGI", ("AGI", None)), ("D1:recording", ("D1", "recording")),
        ("D1:live", ("D1", "live")), ("D1:", None), ("D1:dream", None),
        ("climate", None), ("a b", None),
    ],
)  # fmt: skip
def test_the_short_form_says_id_and_kind(
    word: str, read: tuple[str, str | None] | None
) -> None:
    assert split_word(word) == read
