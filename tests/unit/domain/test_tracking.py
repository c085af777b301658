"""Assignment of sightings to tracks: who is joined, and who never is."""

from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.tracking.tracker import (
    PlacedDetection,
    Sighting,
    Tracker,
    TrackNumbers,
    assign,
)
from tests.builders import START, at
from tests.unit.domain.scene import Scene, person

# --- global assignment ------------------------------------------------------------

costs = st.integers(1, 4).flatmap(
    lambda columns: st.lists(
        st.lists(
            st.one_of(st.floats(0.0, 10.0), st.just(float("inf"))),
            min_size=columns,
            max_size=columns,
        ),
        min_size=1,
        max_size=4,
    )
)


def best(table: list[list[float]]) -> tuple[int, float]:
    """Most pairs, and the least sum with so many, by trying all."""
    rows, columns = len(table), len(table[0])
    if rows > columns:
        return best([list(column) for column in zip(*table, strict=True)])
    found = []
    for order in permutations(range(columns), rows):
        chosen = [table[row][column] for row, column in enumerate(order)]
        known = [cost for cost in chosen if cost < float("inf")]
        found.append((-len(known), sum(known)))
    pairs, total = min(found)
    return -pairs, total


@given(costs)
def test_as_many_pairs_as_can_be_are_made_and_the_cheapest_of_those(
    table: list[list[float]],
) -> None:
    pairs = assign(table)

    assert len({row for row, _ in pairs}) == len({c for _, c in pairs}) == len(pairs)
    total = sum(table[row][column] for row, column in pairs)
    count, least = best(table)
    assert len(pairs) == count
    assert abs(total - least) < 1e-6


# --- who is who -------------------------------------------------------------------


def test_two_who_walk_side_by_side_keep_their_names() -> None:
    scene = Scene()
    for tenth in range(20):
        scene.now = tenth / 10
        scene.look("AGI", person(3.0 + 0.1 * tenth), person(3.0 + 0.1 * tenth, 0.5))

    names = {one.person_id: one.newest.y for one in scene.everyone}
    assert names == {"P1": 0.0, "P2": 0.5}


def follow(scene: Scene, x: float) -> None:
    """AGI sees somebody stand there for 2.6 seconds."""
    began = scene.now
    for tenth in range(27):
        scene.now = began + tenth / 10
        scene.look("AGI", person(x))


@pytest.mark.parametrize(("gap_s", "name"), [(9.0, "P1"), (15.0, "P2")])
def test_who_comes_back_after_a_gap_is_a_new_person_with_a_new_alert(
    gap_s: float, name: str
) -> None:
    scene = Scene()
    follow(scene, 3.0)
    first = scene.everyone[0].decision_id
    scene.now += gap_s

    scene.look("AGI", person(3.5))

    (somebody,) = scene.everyone
    assert somebody.person_id == name
    assert (somebody.decision_id == first) is (name == "P1")


def test_numbers_begin_anew_each_day_and_ids_never_come_again() -> None:
    tracker = Tracker(numbers=TrackNumbers("-5f0c"))
    midnight = 86400.0 - START.wall % 86400.0
    ids: list[str | None] = []
    for after, x in ((0.0, 0.0), (1.0, 50.0), (midnight - 1.0, 0.0), (midnight, 50.0)):
        now = at(after)
        seen = Sighting("AGI", x, 0.0, 0.9, now, "farmer", 0.94)
        tracker.forget(now)
        ids += tracker.track_picture([PlacedDetection("person", seen, "d")], now)

    assert [str(one).partition("-")[0] for one in ids] == ["P1", "P2", "P3", "P1"]
    assert len(set(ids)) == 4


def test_a_glimpse_ends_when_its_place_was_seen_empty_and_a_name_does_not() -> None:
    scene = Scene()
    scene.look("AGI", person(3.0))
    follow(scene, 8.0)
    for one in scene.everyone:
        scene.people.drop_sighting(one.person_id, one.sightings[0])

    gone = scene.people.forget(at(scene.now + 1.5))

    assert [one.person_id for one in gone] == ["P1"]
