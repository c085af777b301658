"""What a robot has heard of iVeg."""

import pytest

from iveg.domain.observations import FeedbackRef, Origin
from iveg.robot.echo import Echo
from tests.builders import origin


def after(*feedback: Origin) -> FeedbackRef | None:
    echo = Echo()
    for one in feedback:
        echo.note(one)
    return echo.heard


def test_before_the_first_feedback_nothing_is_heard() -> None:
    assert after() is None


def test_the_newest_of_all_topics_is_told() -> None:
    assert after(origin(3), origin(5), origin(4)) == FeedbackRef("boot-a", 5)


def test_another_start_of_iveg_takes_over() -> None:
    assert after(origin(900), origin(1, boot="b")) == FeedbackRef("b", 1)


def test_a_late_message_of_an_earlier_start_does_not() -> None:
    found = after(origin(900), origin(1, boot="b"), origin(901), origin(2, boot="b"))

    assert found == FeedbackRef("b", 2)


@pytest.mark.parametrize("nameless", [Origin(), Origin("a"), Origin(None, 3)])
def test_feedback_without_identity_is_not_told(nameless: Origin) -> None:
    assert after(origin(3), nameless) == FeedbackRef("boot-a", 3)
