"""One person is one track: who is joined, revived, merged, and who never is (13.1)."""

from itertools import permutations

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.observations import Instant
from iveg.domain.tracking.person import Sighting
from iveg.domain.tracking.tracker import PlacedDetection, Tracker, TrackNumbers, assign
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


def walk_in_pairs(scene: Scene) -> None:
    """Two people cross a picture side by side, half a metre apart, for two seconds."""
    for tenth in range(20):
        scene.now = tenth / 10
        scene.look("AGI", person(3.0 + 0.1 * tenth), person(3.0 + 0.1 * tenth, 0.5))


def test_two_who_walk_side_by_side_keep_their_names() -> None:
    scene = Scene()
    walk_in_pairs(scene)

    assert {one.person_id: one.newest.y for one in scene.everyone} == {
        "P1": 0.0,
        "P2": 0.5,
    }


def test_two_tracks_that_come_to_one_spot_become_one_and_keep_both_rings() -> None:
    scene = Scene()
    scene.look("AGI", person(3.0))
    scene.look("AGII", person(5.2))
    scene.now = 0.5
    scene.look("AGI", person(4.0))
    scene.now = 1.0
    scene.look("AGII", person(4.4))

    (known,) = scene.everyone
    assert known.person_id == "P1"
    circles = sorted(look.x for look, _ in known.zone_radii(scene.rule, at(scene.now)))
    assert circles == [4.0, 4.4]


def test_two_who_were_in_one_picture_never_become_one() -> None:
    scene = Scene()
    scene.look("AGI", person(3.0), person(6.0))
    for tenth in range(1, 31):
        scene.now = tenth / 10
        scene.look("AGI", person(3.0 + 0.045 * tenth), person(6.0 - 0.045 * tenth))

    assert [one.person_id for one in scene.everyone] == ["P1", "P2"]
    assert scene.everyone[1].newest.x - scene.everyone[0].newest.x < 0.5


def follow(
    scene: Scene, *places: tuple[float, float], seconds: float = 2.6, by: str = "AGI"
) -> None:
    """A robot sees people stand there for so long."""
    began = scene.now
    for tenth in range(round(seconds * 10) + 1):
        scene.now = began + tenth / 10
        scene.look(by, *(person(x, y) for x, y in places))


def names(scene: Scene) -> list[str]:
    return [one.person_id for one in scene.everyone]


def test_who_comes_back_after_a_gap_is_a_new_person_with_a_new_alert() -> None:
    scene = Scene()
    follow(scene, (3.0, 0.0))
    first = scene.everyone[0].decision_id
    scene.now += 15.0

    scene.look("AGI", person(3.0))

    assert names(scene) == ["P2"], "a mark ends where somebody is seen"
    assert scene.everyone[0].decision_id != first


def test_two_who_were_seen_apart_at_once_by_two_robots_never_become_one() -> None:
    scene = Scene()
    for tenth in range(41):
        scene.now = tenth / 10
        scene.look("AGI", person(3.0))
        scene.look("AGII", person(7.0 - 0.1 * tenth))

    assert names(scene) == ["P1", "P2"]
    assert scene.everyone[1].newest.x == 3.0, "at one spot"


def test_the_alert_of_somebody_who_is_followed_stays_the_same() -> None:
    scene = Scene()
    scene.look("AGI", person(3.0))
    first = scene.everyone[0].decision_id
    for tenth in range(1, 30):
        scene.now = tenth / 10
        scene.look("AGI", person(3.0))
    scene.now = 12.0
    scene.look("AGI", person(3.5))

    assert {one.decision_id for one in scene.everyone} == {first}


def test_numbers_begin_anew_each_day_and_ids_never_come_again() -> None:
    tracker, midnight = (
        Tracker(numbers=TrackNumbers("-5f0c")),
        86400.0 - START.wall % 86400.0,
    )
    ids: list[str | None] = []
    for after, x in ((0.0, 0.0), (1.0, 50.0), (midnight - 1.0, 0.0), (midnight, 50.0)):
        now = at(after)
        seen = Sighting("AGI", x, 0.0, 0.9, now, "farmer", 0.94)
        tracker.forget(now)
        ids += tracker.track_picture([PlacedDetection("person", seen, "d", 0)], now)

    assert [str(one).partition("-")[0] for one in ids] == ["P1", "P2", "P3", "P1"]
    assert len(set(ids)) == 4


def test_a_glimpse_ends_when_its_place_was_seen_empty_and_a_name_does_not() -> None:
    scene = Scene()
    scene.look("AGI", person(3.0))
    follow(scene, (8.0, 0.0))
    for one in scene.everyone:
        scene.people.drop_sighting(one.person_id, one.sightings[0])

    gone = scene.people.forget(at(scene.now + 1.5))

    assert [one.person_id for one in gone] == ["P1"]


# --- a name protects nobody -------------------------------------------------------


pictures = st.lists(
    st.tuples(
        st.sampled_from(["AGI", "AGII", "AG3"]),
        st.floats(0.0, 3.0),
        st.lists(st.tuples(st.floats(0, 6), st.floats(0, 3)), max_size=4),
    ),
    min_size=1,
    max_size=30,
)


def rings_of(tracker: Tracker, now: Instant) -> set[tuple[str, float, float, float]]:
    return {
        (look.observer, look.x, look.y, radius)
        for one in tracker.known.values()
        for look, radius in one.zone_radii(DetectionRule(), now)
    }


@given(pictures)
def test_the_union_of_rings_is_the_same_with_and_without_merging(
    seen: list[tuple[str, float, list[tuple[float, float]]]],
) -> None:
    merging, never = Tracker(), Tracker(merge_m=-1.0)
    after = 0.0
    for number, (observer, pause, places) in enumerate(seen):
        after += pause
        now = at(after)
        for tracker in (merging, never):
            tracker.track_picture(
                [
                    PlacedDetection(
                        "person",
                        Sighting(observer, x, y, 0.9, now, "farmer", 0.9),
                        f"d{number}",
                        index,
                    )
                    for index, (x, y) in enumerate(places)
                ],
                now,
            )
        assert rings_of(merging, now) == rings_of(never, now)
