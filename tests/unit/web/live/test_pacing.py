"""Credit: how much telemetry is on its way to one page, whatever the page does."""

import pytest

from iveg.web.live.pacing import (
    BYTES,
    FRAMES,
    GAP_S,
    LATEST_S,
    LONGEST_WAIT_S,
    SCREEN_FRAME_S,
    CreditWindow,
)

NOW = 1000.0


def filled(count: int = FRAMES, heavy: int = 0) -> CreditWindow:
    """A window with that many frames on their way, all sent now."""
    window = CreditWindow()
    for _ in range(count):
        window.sent(heavy, NOW)
    return window


def test_a_page_that_paints_nothing_gets_one_window_and_no_more() -> None:
    window = filled(FRAMES)

    assert window.opens_at == float("inf")


def test_what_is_painted_makes_room_for_as_much() -> None:
    window = filled(FRAMES, heavy=BYTES // FRAMES)

    assert window.painted(3, NOW + 0.02)

    assert window.room == 3 * (BYTES // FRAMES)
    assert window.opens_at < float("inf")


def test_while_none_is_painted_there_is_a_frame_for_each_picture_of_a_screen() -> None:
    window = filled(1)

    assert window.opens_at == NOW + SCREEN_FRAME_S


def opens_after(window: CreditWindow, frames: int, late_s: float) -> float:
    """How long it waits after frames that were so late, asked to wait 50 ms."""
    for _ in range(frames):
        window.sent(0, NOW, late_s)
        window.painted(window.next_number - 1, NOW, 0.05)
    return window.opens_at - NOW


def test_where_frames_are_late_the_next_is_made_earlier_but_never_by_much() -> None:
    window = CreditWindow()

    assert opens_after(window, 1, 0.0) == pytest.approx(0.05)
    assert opens_after(window, 20, 0.003) == pytest.approx(0.047, abs=1e-5)
    assert opens_after(window, 20, 1.0) == pytest.approx(0.05 - LATEST_S, abs=1e-5)
    assert opens_after(window, 200, 0.0) == pytest.approx(0.05, abs=1e-5)


def test_of_few_robots_no_frame_waits_for_others() -> None:
    window = CreditWindow()
    window.gathers = False

    window.sent(0, NOW)
    between_unpainted = window.opens_at
    window.painted(1, NOW + 0.008, 0.05)

    assert between_unpainted == NOW + GAP_S
    assert window.opens_at == NOW + GAP_S


def test_what_is_painted_opens_the_window_at_once_with_a_little_between_frames() -> (
    None
):
    window = filled(1)

    window.painted(1, NOW + 0.001)

    assert window.opens_at == NOW + GAP_S


def test_a_page_is_sent_the_next_frame_when_it_asked_for_it() -> None:
    window = filled(1)

    window.painted(1, NOW + 0.008, 0.005)

    assert window.opens_at == NOW + 0.013


@pytest.mark.parametrize(
    "wait", [2 * LONGEST_WAIT_S, -1.0, float("nan"), float("inf"), "1", True, 10**400]
)
def test_no_page_can_ask_for_telemetry_from_the_past(wait: object) -> None:
    window = filled(1)

    window.painted(1, NOW + 0.02, wait)

    assert window.opens_at == NOW + 0.02


def test_over_a_long_round_trip_the_window_is_spread_and_not_sent_in_one_go() -> None:
    window, now = CreditWindow(), NOW
    for number in range(1, 30):
        window.sent(0, now)
        window.painted(number, now + 0.3)
        now += 1.0

    window.sent(0, now)

    assert window.opens_at - now == pytest.approx(0.3 / FRAMES, rel=0.01)


def test_a_page_that_draws_slowly_is_sent_two_frames_while_it_draws() -> None:
    window, now = CreditWindow(), NOW
    for number in range(1, 30):
        window.sent(0, now)
        window.painted(number, now + 0.2, 0.0, 0.001)
        now += 1.0

    window.sent(0, now)

    assert window.opens_at - now == pytest.approx((0.2 - 0.002) / 2, rel=0.01)


def test_behind_a_long_line_a_page_that_says_so_is_sent_as_many_as_ever() -> None:
    window, now = CreditWindow(), NOW
    for number in range(1, 30):
        window.sent(0, now)
        window.painted(number, now + 0.3, 0.0, 0.145)
        now += 1.0

    window.sent(0, now)

    assert window.opens_at - now == pytest.approx(0.29 / FRAMES, rel=0.01)


def test_a_round_trip_that_becomes_short_again_is_forgotten() -> None:
    window, now = CreditWindow(), NOW
    for number in range(1, 30):
        window.sent(0, now)
        window.painted(number, now + (0.3 if number < 15 else 0.001))
        now += 1.0

    window.sent(0, now)

    assert window.opens_at - now == pytest.approx(SCREEN_FRAME_S)


@pytest.mark.parametrize("word", [9, -1, 0, "1", True, 1.0, None, [1], 10**30])
def test_what_no_page_can_have_painted_gives_no_credit(word: object) -> None:
    window = filled(FRAMES)

    assert not window.painted(word, NOW)

    assert window.opens_at == float("inf")


def test_a_frame_is_painted_once() -> None:
    window = filled(FRAMES, heavy=BYTES // FRAMES)
    window.painted(2, NOW)

    assert not window.painted(2, NOW)
    assert not window.painted(1, NOW)

    assert window.room == 2 * (BYTES // FRAMES)
