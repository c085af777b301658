"""Credit: how much telemetry is on its way to one page, whatever the page does."""

import pytest

from iveg.web.live.feed import FRAMES, GAP_S, CreditWindow

NOW = 1000.0


def filled(count: int = FRAMES) -> CreditWindow:
    """A window with that many frames on their way, all sent now."""
    window = CreditWindow()
    for _ in range(count):
        window.sent(NOW)
    return window


def test_a_page_that_paints_nothing_gets_one_window_and_no_more() -> None:
    window = filled(FRAMES)

    assert window.opens_at == float("inf")


def test_what_is_painted_makes_room() -> None:
    window = filled(FRAMES)

    assert window.painted(1, NOW + 0.02)

    assert window.opens_at < float("inf")


def test_while_none_is_painted_there_is_a_gap_between_frames() -> None:
    window = filled(1)

    assert window.opens_at == NOW + GAP_S


def test_what_is_painted_opens_the_window_at_once_with_a_little_between_frames() -> (
    None
):
    window = filled(1)

    window.painted(1, NOW + 0.001)

    assert window.opens_at == NOW + GAP_S


def test_over_a_long_round_trip_the_window_is_spread_and_not_sent_in_one_go() -> None:
    window, now = CreditWindow(), NOW
    for number in range(1, 30):
        window.sent(now)
        window.painted(number, now + 0.3)
        now += 1.0

    window.sent(now)

    assert window.opens_at - now == pytest.approx(0.3 / FRAMES, rel=0.01)


@pytest.mark.parametrize("word", [9, -1, 0, "1", True, 1.0, None, [1], 10**30])
def test_what_no_page_can_have_painted_gives_no_credit(word: object) -> None:
    window = filled(FRAMES)

    assert not window.painted(word, NOW)

    assert window.opens_at == float("inf")
