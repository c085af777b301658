"""Ages that are proven by what a robot had heard."""

import pytest

from iveg.domain.observations import FeedbackRef
from iveg.domain.world import FeedbackLedger


def ledger(*moments: float, each: int = 2) -> FeedbackLedger:
    """Feedback of boot ``iveg`` to so many robots, composed at these moments (s)."""
    book = FeedbackLedger()
    for number, moment in enumerate(moments):
        first = 1 + number * each
        book.composed("iveg", first, first + each - 1, moment)
    return book


def heard(seq: int, boot: str = "iveg") -> FeedbackRef:
    return FeedbackRef(boot, seq)


@pytest.mark.parametrize(
    ("seq", "moment"), [(1, 10.0), (2, 10.0), (3, 10.1), (4, 10.1), (6, 10.2)]
)
def test_what_was_heard_tells_when_it_was_composed(seq: int, moment: float) -> None:
    assert ledger(10.0, 10.1, 10.2).composed_at(heard(seq)) == moment


@pytest.mark.parametrize(
    "echoes", [(), (heard(0),), (heard(7),), (heard(3, boot="an earlier iVeg"),)]
)
def test_what_was_never_sent_proves_nothing(echoes: tuple[FeedbackRef, ...]) -> None:
    assert ledger(10.0, 10.1, 10.2).composed_at(*echoes) is None
    assert FeedbackLedger().composed_at(*echoes) is None


def test_of_several_authors_ours_proves_the_age_wherever_it_stands() -> None:
    echoes = heard(9, boot="another"), heard(99), heard(5), heard(2)
    assert ledger(10.0, 10.1, 10.2).composed_at(*echoes) == 10.2


def test_moments_close_together_answer_with_the_older_one() -> None:
    book = ledger(10.0, 10.02, 10.04, 10.06, each=1)

    assert [book.composed_at(heard(seq)) for seq in (1, 2, 3, 4)] == [10.0] * 3 + [
        10.06
    ]


def test_ten_minutes_of_feedback_are_remembered_and_no_day() -> None:
    book = ledger(*(0.1 * number for number in range(100_000)), each=1)

    assert book.composed_at(heard(99_500)) == pytest.approx(0.1 * 99_499)
    moment = book.composed_at(heard(94_000))
    assert moment is not None
    assert 0.1 * 93_999 - 1.0 < moment <= 0.1 * 93_999
    assert book.composed_at(heard(1)) is None
