"""Telemetry of one browser: the newest of what changed, in a window, at its pace."""

import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import orjson
import pytest

from iveg.web.live.feed import (
    BYTES,
    FRAMES,
    GAP_S,
    ROBOT_GAP_S,
    Painting,
    TelemetryFeed,
)
from iveg.web.live.telemetry import NO_RETURN, UNIT_M
from tests.builders import detection, scan
from tests.unit.web.desk import WebDesk

MANY = tuple(f"R{number:02d}" for number in range(20))


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
        """The next frame, if there may be one now; then as a browser's line does."""
        frame = self.feed.next_frame(self.desk.clock())
        self.feed.write_ahead(self.desk.clock())
        frame = frame or self.feed.next_frame(self.desk.clock())
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
            self.desk.clock.now += 1.01 * self.feed.window.gap_s

    def told(self, member: str) -> list[Any]:
        """All that frames told under a member."""
        return [one for frame in self.frames for one in frame[member]]

    def topics(self) -> list[str]:
        return [one["topic"] for one in self.told("parts") + self.told("scans")]


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


def test_however_much_has_changed_a_frame_tells_of_each_robot_once() -> None:
    desk = WebDesk(MANY)
    page = Page(desk)
    for number in range(5):
        for robot_id in MANY:
            desk.drive(robot_id, float(number))

    page.read()

    assert [move[0] for move in page.told("moves")] == list(MANY)
    assert {move[3] for move in page.told("moves")} == {4.0}


def _page_of_many_scans() -> Page:
    """A page whose first frame is full of a fleet's scans."""
    desk = WebDesk(MANY)
    page = Page(desk)
    for robot_id in MANY:
        desk.drive(robot_id)
        desk.hear(_wide_scan(desk, robot_id))
    page.read()
    return page


def test_heavy_parts_on_their_way_are_bounded_and_go_on_in_turn() -> None:
    page = _page_of_many_scans()
    page.desk.clock.now += 1.0
    page.read()
    unpainted = sum(map(len, page.bodies))
    page.paint()
    page.read_all()

    assert unpainted <= BYTES
    told = [one["robot_id"] for one in page.told("scans")]
    assert sorted(told) == sorted(MANY)


@pytest.mark.parametrize(("robots", "gap_s"), [(2, GAP_S), (20, 20 * ROBOT_GAP_S)])
def test_the_more_robots_the_more_of_them_share_a_frame(
    robots: int, gap_s: float
) -> None:
    fleet = MANY[:robots]
    desk = WebDesk(fleet)
    page = Page(desk)
    for robot_id in fleet:
        desk.drive(robot_id)
    page.read()
    page.paint()
    desk.drive(fleet[0], 1.0)

    assert page.feed.wait_s(desk.clock().mono) == pytest.approx(gap_s)
    assert page.read() is None
    desk.drive(fleet[0], 2.0)
    desk.clock.now += gap_s + 1e-6
    page.read()
    assert [move[3] for move in page.told("moves")] == [0.0] * robots + [2.0]


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


def test_nothing_new_is_no_frame(desk: WebDesk, page: Page) -> None:
    desk.drive("AGI")
    page.read_all()
    desk.clock.now += 1.0
    desk.hub.changed("robots/AGII/scan")

    assert page.read() is None
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


def test_a_move_says_when_it_was_true_and_its_stamp_as_the_robot_sent_it(
    desk: WebDesk, page: Page
) -> None:
    desk.drive("AGI", 1.23456)
    now = desk.clock().mono
    page.read()

    (move,) = page.told("moves")
    robot = desk.views.robot("AGI", desk.clock())
    assert move[:4] == ["AGI", now, robot.age_s, 1.235]
    assert move[-1] == robot.stamp


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


def _wide_scan(desk: WebDesk, robot_id: str, beams: int = 720) -> Any:
    ranges = np.linspace(1.0, 9.0, beams, dtype=np.float32)
    return scan(robot_id=robot_id, origin=desk.next_origin(), ranges=ranges)
