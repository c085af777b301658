"""The life of an alert after ISA-18.2."""

from dataclasses import replace

import pytest

from iveg.domain.alerts import GROUPING_S, MOST_KEPT, AlertBook, BookedAlert
from iveg.domain.events import Condition
from tests.builders import at

LOST = Condition("P1", "alert.moving_robot_lost", "AGI", "AGI")
SLOWED = Condition("P2", "alert.person_slowed", "AGI/P1", "AGI")


def test_a_p1_that_is_over_waits_until_somebody_has_seen_it() -> None:
    book = AlertBook()
    (raised,) = book.sync([LOST], at(0), "a")
    book.sync([], at(5), "b")
    book.sync([], at(6 + 2 * GROUPING_S), "c")

    (waiting,) = book.waiting
    book.acknowledge(raised.alert_id, "ana", "", at(7 + 2 * GROUPING_S))

    assert (waiting.priority, waiting.cleared) == ("P1", at(5))
    assert book.waiting == []


def test_p1s_that_nobody_ever_sees_do_not_fill_the_memory() -> None:
    book = AlertBook()

    for second in range(0, 10 * MOST_KEPT, 10):
        wrong = [replace(LOST, subject=f"AGI/{second}")]
        book.sync(wrong, at(second * GROUPING_S), f"{second}")

    assert len(book.waiting) <= MOST_KEPT + 1


def test_the_first_acknowledgement_keeps_who_when_and_note_and_hides_nothing() -> None:
    book = AlertBook()
    (raised,) = book.sync([LOST], at(0), "a")

    book.acknowledge(raised.alert_id, "ana", "on my way", at(3))
    book.acknowledge(raised.alert_id, "ben", "no, mine", at(4))

    (active,) = book.waiting
    assert active.last.acknowledged == at(3)
    assert (active.last.acknowledged_by, active.last.note) == ("ana", "on my way")
    assert active.unseen is None


@pytest.mark.parametrize(("after_s", "count"), [(0.0, 2), (0.2, 1)])
def test_what_comes_back_soon_is_counted_and_later_it_is_a_new_alert(
    after_s: float, count: int
) -> None:
    book = AlertBook()
    (first,) = book.sync([LOST], at(0), "a")
    book.acknowledge(first.alert_id, "ana", "", at(3))
    book.sync([], at(5), "b")
    book.sync([], at(4.9 + after_s + GROUPING_S), "c")

    (again,) = book.sync([LOST], at(5 + after_s + GROUPING_S), "d")

    assert (again.count, again.alert_id == first.alert_id) == (count, count == 2)


def test_what_changes_about_a_condition_is_shown_without_raising_it_again() -> None:
    book = AlertBook()
    book.sync([SLOWED], at(0), "a")
    nearer = Condition("P2", SLOWED.key, SLOWED.subject, "AGI", {"distance": 0.9})

    assert book.sync([nearer], at(1), "b") == []
    assert book.waiting[0].condition.slots == {"distance": 0.9}


def ended_before() -> BookedAlert:
    """A P1 of an earlier run, over when that ended."""
    earlier = AlertBook()
    earlier.sync([LOST], at(0), "a")
    (over,) = earlier.sync([], at(5), "b")
    return over


def test_13_6_a_p1_of_an_earlier_run_waits_on_and_joins_what_still_holds() -> None:
    over, book = ended_before(), AlertBook()

    book.remember([over])
    book.sync([LOST], at(8), "c")

    (waiting,) = book.waiting
    assert (waiting.alert_id, waiting.count) == (over.alert_id, 2)


def test_13_6_what_is_raised_before_the_history_answers_hides_nothing_earlier() -> None:
    over, book = ended_before(), AlertBook()

    (now,) = book.sync([LOST], at(8), "c")
    book.remember([over])
    book.acknowledge(now.alert_id, "ana", "", at(9))

    assert over.alert_id in {one.alert_id for one in book.waiting}
