"""Δt₄: pages are believed about moments that can be, and about nothing else."""

import math

import pytest

from iveg.domain.latency import LatencyWatch, Sketch, merged
from iveg.domain.observations import Received
from iveg.domain.transports import DIRECT
from iveg.web.live.feed import Painting
from tests.builders import at, odometry, origin

START = at(0.0).mono


def watching() -> tuple[LatencyWatch, Painting]:
    """AGI's odometry was decided on at 1.0 s."""
    watch = LatencyWatch(("AGI",), lambda *_: None)
    watch.decided([Received(odometry(origin=origin()), at(0.9), DIRECT.id)], at(1.0))
    return watch, Painting(watch)


def took(watch: LatencyWatch) -> Sketch:
    return merged(watch.streams[0].segments["screen"].parts())


def send(painting: Painting, number: int, now: float) -> None:
    painting.adds("robots/AGI", START + now)
    painting.sent(number, START + now)


def test_what_a_page_drew_is_measured_from_the_decision() -> None:
    watch, painting = watching()
    send(painting, 1, 1.01)

    painting.painted(1, START + 1.04, 0.002, START + 1.05)

    assert took(watch).count == 1
    assert took(watch).mean == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("moment", "within"),
    [
        (START + 9.0, 0.001),
        (START + 0.5, 0.001),
        (START - 3600.0, 0.001),
        (math.nan, 0.001),
        (math.inf, 0.001),
        ("now", 0.001),
        (True, 0.001),
        ([], 0.001),
        (START + 1.04, None),
        (START + 1.04, -1.0),
        (START + 1.04, 5.0),
        (START + 0.98, 0.05),
    ],
)
def test_a_moment_that_cannot_be_is_not_used(moment: object, within: object) -> None:
    watch, painting = watching()
    send(painting, 1, 1.01)

    painting.painted(1, moment, within, START + 1.05)

    assert took(watch).count == 0


@pytest.mark.parametrize(
    "topic",
    ["people", "robots/AGI/state", "robots/AGIX", "detections/AGI", "robots/AGI/scan"],
)
def test_what_was_never_decided_on_is_not_sampled(topic: str) -> None:
    watch, painting = watching()
    painting.adds(topic, START + 1.01)
    painting.sent(1, START + 1.01)

    painting.painted(1, START + 1.04, 0.001, START + 1.05)

    assert all(one.segments["screen"].count == 0 for one in watch.streams)
