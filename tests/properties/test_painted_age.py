"""How old a picture can be: the window, a line and a page that paints at its own pace.

The line has a round trip and no other limit; the page paints what has come every so
often and says so.  Times are monotonic (s); the news is new at every moment.
"""

from hypothesis import given
from hypothesis import strategies as st

from iveg.web.live.feed import CreditWindow

SECONDS = 12.0
SETTLED = 6.0
"""The window learns the round trip from its first frames."""
STEP = 0.001


def oldest_painted(frame_s: float, round_trip_s: float) -> float:
    """The greatest age of what is on the screen, just after it was painted (s)."""
    window = CreditWindow()
    on_the_way: list[tuple[float, int, float]] = []
    answers: list[tuple[float, int]] = []
    newest, told, age = (0, 0.0), 0, 0.0
    next_paint = frame_s
    for tick in range(int(SECONDS / STEP)):
        now = tick * STEP
        while answers and answers[0][0] <= now:
            window.painted(answers.pop(0)[1], now)
        if window.opens_at <= now:
            on_the_way.append((now + round_trip_s / 2, window.next_number, now))
            window.sent(1, now)
        if now < next_paint:
            continue
        next_paint += frame_s
        while on_the_way and on_the_way[0][0] <= now:
            _, number, made_at = on_the_way.pop(0)
            newest = number, made_at
        if newest[0] > told:
            told = newest[0]
            answers.append((now + round_trip_s / 2, told))
        if now > SETTLED:
            age = max(age, now - newest[1])
    return age


@given(
    st.floats(min_value=0.004, max_value=0.4),
    st.floats(min_value=0.0, max_value=0.6),
)
def test_what_is_painted_is_no_older_than_two_frames_and_the_round_trip(
    frame_s: float, round_trip_s: float
) -> None:
    bound = 2 * frame_s + round_trip_s + STEP

    assert oldest_painted(frame_s, round_trip_s) <= bound
