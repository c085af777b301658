"""Δt₄: pages are believed about moments that can be, and about nothing else."""

import math

import pytest

from iveg.domain.latency.segments import Exclusion
from iveg.domain.latency.sketch import Sketch, merged
from iveg.domain.latency.stream import Stream
from iveg.domain.latency.watch import LatencyWatch
from iveg.domain.observations import Received
from iveg.domain.transports import DIRECT
from iveg.web.live.painting import SAMPLE_S, Painting
from tests.builders import at, odometry, origin

START = at(0.0).mono


def watching() -> tuple[LatencyWatch, Painting]:
    """AGI's odometry was decided on at 1.0 s."""
    watch = LatencyWatch(("AGI",))
    watch.decided([Received(odometry(origin=origin()), at(0.9), DIRECT.id)], at(1.0))
    return watch, Painting(watch)


def stream(watch: LatencyWatch) -> Stream:
    return watch.streams[0]


def took(watch: LatencyWatch) -> Sketch:
    return merged(stream(watch).segments["screen"].parts("1min"))


def send(painting: Painting, number: int, now: float) -> None:
    painting.adds("robots/AGI", START + now)
    painting.sent(number, START + now)


def test_what_a_page_drew_is_measured_from_the_decision() -> None:
    watch, painting = watching()
    send(painting, 1, 1.01)

    painting.painted(1, START + 1.04, 0.002, START + 1.05)

    assert took(watch).count == 1
    assert took(watch).mean == pytest.approx(0.04)
    assert watch.pages_within_s == 0.002


def test_a_page_that_drew_nothing_gives_no_sample() -> None:
    watch, painting = watching()
    send(painting, 1, 1.01)

    painting.painted(1, None, None, START + 1.05)

    assert took(watch).count == 0
    assert not stream(watch).excluded


def test_a_topic_is_sampled_ten_times_a_second_at_most() -> None:
    watch, painting = watching()
    for number in range(1, 9):
        now = 1.01 + (number - 1) * SAMPLE_S / 4
        send(painting, number, now)
        painting.painted(number, START + now + 0.01, 0.001, START + now + 0.02)

    assert took(watch).count == 2


def test_a_frame_that_was_drawn_takes_those_before_it_along() -> None:
    watch, painting = watching()
    send(painting, 1, 1.01)
    send(painting, 2, 1.02 + SAMPLE_S)

    painting.painted(2, START + 1.2, 0.001, START + 1.21)
    painting.painted(2, START + 1.3, 0.001, START + 1.31)

    assert took(watch).count == 2


@pytest.mark.parametrize(
    ("moment", "within", "why"),
    [
        (START + 9.0, 0.001, "page_nonsense"),
        (START + 0.5, 0.001, "page_nonsense"),
        (START - 3600.0, 0.001, "page_nonsense"),
        (math.nan, 0.001, "page_nonsense"),
        (math.inf, 0.001, "page_nonsense"),
        ("now", 0.001, "page_nonsense"),
        (True, 0.001, "page_nonsense"),
        ([], 0.001, "page_nonsense"),
        (START + 1.04, None, "page_nonsense"),
        (START + 1.04, -1.0, "page_nonsense"),
        (START + 1.04, 5.0, "clock_untrusted"),
        (START + 0.98, 0.05, "negative"),
    ],
)
def test_a_moment_that_cannot_be_is_counted_and_not_used(
    moment: object, within: object, why: Exclusion
) -> None:
    watch, painting = watching()
    send(painting, 1, 1.01)

    painting.painted(1, moment, within, START + 1.05)

    assert took(watch).count == 0
    assert stream(watch).excluded["screen", why] == 1


@pytest.mark.parametrize(
    "topic",
    ["people", "robots/AGI/state", "robots/AGIX", "detections/AGI", "robots/AGI/scan"],
)
def test_what_was_never_decided_on_is_not_sampled(topic: str) -> None:
    watch, painting = watching()
    painting.adds(topic, START + 1.01)
    painting.sent(1, START + 1.01)

    painting.painted(1, START + 1.04, 0.001, START + 1.05)

    assert all(not one.segments["screen"].parts("1min") for one in watch.streams)
