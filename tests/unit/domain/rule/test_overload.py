"""More people than there is room for: nobody known is dropped."""

from iveg.domain.limits import LIMITS
from iveg.domain.tracking.tracker import MAX_PEOPLE
from tests.unit.domain.scene import Scene, person


def crowd(scene: Scene, count: int, *, first: int = 0) -> None:
    """AGI sees so many people, each far from the others, in one look."""
    numbers = range(first, first + count)
    scene.look("AGI", *(person(5.0 * (n % 60), 5.0 * (n // 60)) for n in numbers))


def full() -> Scene:
    scene = Scene()
    crowd(scene, MAX_PEOPLE)
    return scene


def test_whoever_has_a_ring_stays_when_more_come_and_is_seen_again() -> None:
    scene = full()
    known = [one.person_id for one in scene.everyone]
    crowd(scene, 40, first=MAX_PEOPLE)
    assert [one.person_id for one in scene.everyone] == known
    assert scene.people.turned_away == 40

    scene.now = 0.5
    (placed,) = scene.look("AGI", person(0.2, 0.0))
    assert placed.person is not None
    assert placed.person.person_id == "P1"
    assert scene.people.turned_away == 0


def test_who_was_seen_once_long_ago_gives_way_and_who_was_seen_twice_never() -> None:
    scene = full()
    scene.now = 0.5
    scene.look("AGI", person(0.0))
    scene.now = LIMITS.zone_lasts_s + LIMITS.seen_s
    crowd(scene, 3, first=3 * MAX_PEOPLE)
    left = {one.person_id for one in scene.everyone}
    assert {"P1", "P257", "P258", "P259"} <= left
    assert "P2" not in left
    assert len(left) <= MAX_PEOPLE
    assert scene.people.turned_away == 0
