"""Telemetry of one browser: the newest of what changed, in a window, at its pace.

Pages are believed about moments that can be, and about nothing else.
"""

import math
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import orjson
import pytest

from iveg.domain.latency import LatencyWatch, Sketch, merged
from iveg.domain.observations import Received
from iveg.domain.transports import DIRECT
from iveg.web.live.feed import FRAMES, GAP_S, CreditWindow, Painting, TelemetryFeed
from iveg.web.live.telemetry import NO_RETURN, UNIT_M
from tests.builders import START, at, detection, odometry, origin, scan
from tests.unit.web.desk import WebDesk

NOW = START.mono


@dataclass
class Page:
    """A page without a screen: reads frames, paints when it is told to."""

    desk: WebDesk
    frames: list[dict[str, Any]] = field(default_factory=list)
    bodies: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.subscriber = self.desk.hub.join()
        self.feed = TelemetryFeed(
            self.desk.encoder.telemetry, self.subscriber, Painting(self.desk.latency)
        )

    def read(self) -> dict[str, Any] | None:
        """The next frame, if there may be one now."""
        frame = self.feed.next_frame(self.desk.clock())
        if frame is None:
            return None
        (length,) = struct.unpack_from("<I", frame)
        assert length % 4 == 0
        self.frames.append(orjson.loads(frame[4 : 4 + length]))
        self.bodies.append(frame[4 + length :])
        return self.frames[-1]

    def paint(self) -> None:
        """Say that the newest frame was painted."""
        self.feed.painted(self.frames[-1]["frame"], self.desk.clock().mono, {})

    def read_all(self) -> None:
        """All that is known now, each frame painted at once."""
        while self.read() is not None:
            self.paint()
            self.desk.clock.now += 1.01 * GAP_S

    def told(self, member: str) -> list[Any]:
        """All that frames told under a member."""
        return [one for frame in self.frames for one in frame[member]]


@pytest.fixture
def desk() -> WebDesk:
    return WebDesk()


@pytest.fixture
def page(desk: WebDesk) -> Page:
    return Page(desk)


def test_a_slow_page_skips_and_never_lags(desk: WebDesk, page: Page) -> None:
    for number in range(100):
        desk.drive("AGI", float(number))
        desk.clock.now += 0.05
        page.read()
    page.paint()
    page.read()

    xs = [move[3] for move in page.told("moves")]
    assert xs[-1] == 99.0
    assert xs == sorted(xs)
    assert len(xs) == FRAMES + 1


def test_changes_within_a_gap_share_a_frame(desk: WebDesk, page: Page) -> None:
    desk.drive("AGI")
    page.read()
    page.paint()
    desk.drive("AGI", 1.0)

    assert page.feed.wait_s(desk.clock().mono) == pytest.approx(GAP_S)
    assert page.read() is None
    desk.drive("AGI", 2.0)
    desk.clock.now += GAP_S + 1e-6
    page.read()
    assert [move[3] for move in page.told("moves")] == [0.0, 2.0]


def test_without_credit_a_change_wakes_nobody(desk: WebDesk, page: Page) -> None:
    for _ in range(FRAMES):
        desk.drive("AGI")
        page.read()
        desk.clock.now += 1.0

    assert page.feed.wait_s(desk.clock().mono) is None
    assert not page.subscriber.wants_telemetry
    page.paint()
    desk.drive("AGI")
    assert page.feed.wait_s(desk.clock().mono) == 0.0
    assert page.subscriber.wants_telemetry


def test_while_much_is_unpainted_a_frame_has_positions_alone(
    desk: WebDesk, page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("iveg.web.live.feed.CREDIT", 1)
    for number in range(3):
        desk.drive("AGI", float(number))
        page.read()
        desk.clock.now += 1.0

    assert [move[3] for move in page.told("moves")] == [0.0, 1.0, 2.0]
    assert [one["topic"] for one in page.told("parts")] == ["robots/AGI"]
    assert page.feed.wait_s(desk.clock().mono) is None


def test_a_robot_is_told_whole_once_and_then_what_changes(
    desk: WebDesk, page: Page
) -> None:
    desk.drive("AGI")
    page.read_all()
    desk.clock.now += 0.5
    desk.drive("AGI", 7.0)
    page.read_all()

    parts = [one["data"] for one in page.told("parts") if one["topic"] == "robots/AGI"]
    first, then = parts
    assert {"robot_id", "mode", "speed_limit", "stop_state", "profile"} <= first.keys()
    assert not {"pose", "twist", "stamp", "age_s"} & first.keys()
    assert "received_at" in then
    assert not {"robot_id", "mode", "profile"} & then.keys()


def test_of_people_those_are_told_of_whom_there_is_more_to_say_than_an_age(
    desk: WebDesk, page: Page
) -> None:
    desk.drive("AGI")
    desk.drive("AGII", 50.0)
    desk.look("AGI", detection("farmer", 5.0))
    desk.look("AGII", detection("farmer", 55.0))
    page.read_all()
    desk.clock.now += 0.3
    desk.look("AGII", detection("farmer", 55.1))
    page.read_all()

    told = [one for one in page.told("parts") if one["topic"] == "people"]
    ids = [[one["person_id"] for one in each["data"]["changed"]] for each in told]
    assert ids == [["P1", "P2"], ["P2"]]
    assert [one["data"]["ids"] for one in told] == [["P1", "P2"]] * 2
    ages = [one["age_s"] for one in told[0]["data"]["changed"]]
    assert ages == [0.0, 0.0]


def test_a_scan_is_ranges_in_integers_finer_than_a_centimetre(
    desk: WebDesk, page: Page
) -> None:
    desk.drive("AGI", 10.0)
    told = scan(origin=desk.next_origin())
    desk.hear(told)
    page.read()

    (head,) = page.told("scans")
    units = np.frombuffer(page.bodies[0], "<u2")[: head["count"]]
    counts = told.returns()
    assert UNIT_M <= 0.01
    assert head["unit_m"] == UNIT_M
    assert (head["x"], head["y"], head["yaw"]) == (10.0, 0.0, 0.0)
    assert units.size == told.ranges.size
    assert (units[~counts] == NO_RETURN).all()
    np.testing.assert_allclose(
        units[counts] * UNIT_M, told.ranges[counts], atol=UNIT_M / 2 + 1e-6
    )
    assert len(page.bodies[0]) % 4 == 0


# --- the window: how much is on its way to one page -------------------------------


def filled(count: int = FRAMES) -> CreditWindow:
    """A window with that many frames on their way, all sent now."""
    window = CreditWindow()
    for _ in range(count):
        window.sent(1, NOW)
    return window


def test_over_a_long_round_trip_the_window_is_spread_and_not_sent_in_one_go() -> None:
    window, now = CreditWindow(), NOW
    for number in range(1, 30):
        window.sent(1, now)
        window.painted(number, now + 0.3)
        now += 1.0

    window.sent(1, now)

    assert window.opens_at - now == pytest.approx(0.3 / FRAMES, rel=0.01)


@pytest.mark.parametrize("word", [9, -1, 0, "1", True, 1.0, None, [1], 10**30])
def test_what_no_page_can_have_painted_gives_no_credit(word: object) -> None:
    window = filled()

    assert not window.painted(word, NOW)
    assert window.opens_at == math.inf
    assert window.painted(1, NOW + 0.02)
    assert window.opens_at < math.inf


# --- Δt₄: from the decision to the drawn frame ------------------------------------


def drawn(topic: str, moment: object, within: object) -> Sketch:
    """What is measured when AGI's odometry was decided on at 1.0 s, sent at 1.01 s."""
    watch = LatencyWatch(("AGI",), lambda *_: None)
    watch.decided([Received(odometry(origin=origin()), at(0.9), DIRECT.id)], at(1.0))
    painting = Painting(watch)
    painting.adds(topic, NOW + 1.01)
    painting.sent(1, NOW + 1.01)
    painting.painted(1, moment, within, NOW + 1.05)
    parts = [one.segments["screen"].parts() for one in watch.streams.values()]
    return merged(part for each in parts for part in each)


def test_what_a_page_drew_is_measured_from_the_decision() -> None:
    measured = drawn("robots/AGI", NOW + 1.04, 0.002)

    assert measured.count == 1
    assert measured.mean == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("moment", "within"),
    [
        (NOW + 9.0, 0.001),
        (NOW + 0.5, 0.001),
        (math.nan, 0.001),
        (math.inf, 0.001),
        ("now", 0.001),
        (True, 0.001),
        (NOW + 1.04, None),
        (NOW + 1.04, -1.0),
        (NOW + 1.04, 5.0),
        (NOW + 0.98, 0.05),
    ],
)
def test_a_moment_that_cannot_be_is_not_used(moment: object, within: object) -> None:
    assert drawn("robots/AGI", moment, within).count == 0


@pytest.mark.parametrize("topic", ["people", "robots/AGIX", "detections/AGI"])
def test_what_was_never_decided_on_is_not_sampled(topic: str) -> None:
    assert drawn(topic, NOW + 1.04, 0.001).count == 0
