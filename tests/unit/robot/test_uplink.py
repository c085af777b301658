"""What a robot sends, in which order, and what it cannot place."""

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from typing import Literal

import pytest

from iveg.domain.errors import HopError
from iveg.domain.geometry import Twist2D
from iveg.domain.observations import (
    DetectionFrame,
    FeedbackRef,
    Hold,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    SafetyReport,
    Unplaced,
)
from iveg.ngsi import codec
from iveg.robot.gate import Cap
from iveg.robot.holds import HoldSet
from iveg.robot.uplink import LEVELS, LaneMessage, SafetyLane, Sender, Uplink
from tests.builders import START, detection, detection_frame, odometry, scan
from tests.unit.robot.rig import AHEAD, REST, Rig, stop, until

# --- lane -------------------------------------------------------------------------

FIRST = HoldSet((Hold("01A", "iveg", "remote"),))
SECOND = HoldSet((Hold("01B", "iveg", "remote"),))


class World:
    """A disk and a broker that tell in which order they were used."""

    def __init__(self) -> None:
        self.seen: list[object] = []
        self.disk_ready = threading.Event()
        self.disk_ready.set()
        self.disk_fails = False
        self.broker_away = False
        self.refused = 0
        self.confirms = asyncio.Event()
        self.confirms.set()
        self.lane = SafetyLane(self.keep, self.publish)

    def keep(self, holds: HoldSet) -> None:
        self.disk_ready.wait(10)
        if self.disk_fails:
            raise OSError("no space")
        self.seen.append(holds)

    async def publish(self, _: str, payload: bytes) -> None:
        if self.broker_away:
            self.refused += 1
            raise HopError("mqtt", "not connected")
        self.seen.append(payload)
        await self.confirms.wait()

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[SafetyLane]:
        jobs = [
            asyncio.create_task(self.lane.keep_forever()),
            asyncio.create_task(self.lane.send_forever()),
        ]
        yield self.lane
        for job in jobs:
            job.cancel()
        await asyncio.gather(*jobs, return_exceptions=True)

    async def until_seen(self, count: int) -> None:
        await until(lambda: len(self.seen) >= count)


def message(text: str) -> LaneMessage:
    return "t", text.encode()


async def test_an_answer_waits_for_the_disk() -> None:
    world = World()
    world.disk_ready.clear()
    async with world.running() as lane:
        lane.persist(FIRST)
        lane.answer(message("answer"))
        lane.report(message("report"))
        await world.until_seen(1)
        assert world.seen == [b"report"]
        world.disk_ready.set()
        await world.until_seen(3)
    assert world.seen == [b"report", FIRST, b"answer"]


async def test_a_full_disk_does_not_silence_the_robot() -> None:
    world = World()
    world.disk_fails = True
    async with world.running() as lane:
        for number in range(3):
            lane.persist(FIRST)
            lane.answer(message(str(number)))
            await world.until_seen(number + 1)
        world.disk_fails = False
        lane.persist(SECOND)
        await world.until_seen(4)
        lane.answer(message("last"))
        await world.until_seen(5)
    assert world.seen == [b"0", b"1", b"2", SECOND, b"last"]


async def test_what_finds_no_broker_is_not_sent_later() -> None:
    world = World()
    world.broker_away = True
    async with world.running() as lane:
        lane.answer(message("lost"))
        await until(lambda: world.refused == 1)
        world.broker_away = False
        lane.answer(message("sent"))
        await world.until_seen(1)
    assert world.seen == [b"sent"]


async def test_with_sixteen_unconfirmed_the_newest_report_waits_for_room() -> None:
    world = World()
    world.confirms.clear()
    async with world.running() as lane:
        for number in range(16):
            lane.answer(message(str(number)))
        await world.until_seen(16)
        lane.report(message("old"))
        await asyncio.sleep(0)
        lane.report(message("new"))
        lane.answer(message("answer"))
        await asyncio.sleep(0.01)
        waited = world.seen[16:]
        world.confirms.set()
        await world.until_seen(18)
    assert waited == []
    assert world.seen[16:] == [b"answer", b"new"]


# --- uplink -----------------------------------------------------------------------

AT = Instant(7.25, START.wall)
BLANK = Origin()
Echoes = Callable[[float], tuple[FeedbackRef, ...]]


class Wire:
    """Keeps what an uplink offered."""

    def __init__(self, echoes: Echoes | None = None) -> None:
        self.sent: list[tuple[str, bytes]] = []
        self.uplink = Uplink(
            Sender("AGI", "iveg", "boot-a", first_report=700),
            lambda topic, payload: self.sent.append((topic, payload)),
            echoes,
        )

    def read(self) -> list[object]:
        """What iVeg makes of all that was sent."""
        read = [codec.read_measure(at.split("/")[2], raw) for at, raw in self.sent]
        return [observation for one in read for observation in one.observations]


@pytest.mark.parametrize(
    ("observation", "topic"),
    [
        (odometry(origin=BLANK), "/iveg/AGI_odom/attrs"),
        (scan(origin=BLANK), "/iveg/AGI_lidar2D/attrs"),
        (detection_frame(origin=BLANK), "/iveg/AGI_yolox_bounding_boxes/attrs"),
        (Navigation("", BLANK, "drive", (1.0, 2.0)), "/iveg/AGI_nav/attrs"),
    ],
)
def test_each_sensor_has_its_topic_and_each_message_its_origin(
    observation: Odometry | LaserScan | DetectionFrame | Navigation, topic: str
) -> None:
    wire = Wire()
    wire.uplink.send(replace(observation, robot_id=""), AT)
    wire.uplink.send(observation, AT.later(1.0))
    assert [where for where, _ in wire.sent] == [topic, topic]
    first, second = wire.read()
    assert isinstance(first, type(observation))
    assert isinstance(second, type(observation))
    assert first.robot_id == "AGI"
    assert first.origin == Origin(
        "boot-a", 1, "2023-11-14T22:13:20.000Z", AT.wall, AT.mono
    )
    assert second.origin.seq == 2
    assert not second.origin.acknowledgements, "a recording proves nothing"


def test_a_report_for_iveg_alone_goes_past_the_agent_in_the_same_count() -> None:
    wire = Wire()
    report = SafetyReport("AGI", BLANK, 0.0, "hold")
    first, messages = wire.uplink.report(report, AT, is_measure=False)
    second, _ = wire.uplink.report(report, AT)
    assert [topic for topic, _ in messages] == ["/AGI/iveg/safety"]
    assert (first, second) == (700, 701)


def test_every_message_tells_what_had_been_heard_when_it_was_measured() -> None:
    old, new, other = (FeedbackRef(*ref) for ref in (("a", 40), ("a", 41), ("b", 7)))
    wire = Wire(lambda at: (new, other) if at >= 7.0 else (old,) if at >= 5.0 else ())
    for one in (odometry(), scan(), detection_frame("AGI", detection())):
        for age_s in (4.0, 0.5, 0.0):
            wire.uplink.send(replace(one, origin=BLANK), AT, age_s)

    sent = [one.origin for one in wire.read() if isinstance(one, Observation)]

    said = [(one.mono, AT.wall - (one.stamp_s or 0.0), one.echoes) for one in sent]
    assert said == [(3.25, 4, ()), (6.75, 0.5, (old,)), (7.25, 0, (new, other))] * 3
    assert all(one.acknowledgements for one in sent)


def test_the_moments_of_a_topic_rise_whatever_stamps_do() -> None:
    wire = Wire()
    for number, age_s in enumerate((10.0, 0.05, 5.0, 9.0, 10.0, 0.0), 1):
        at = Instant(number / 10, START.wall + number / 10)
        wire.uplink.send(odometry(origin=BLANK), at, age_s)
    read = [one.origin.mono for one in wire.read() if isinstance(one, Odometry)]
    moments = [mono for mono in read if mono is not None]
    assert moments == sorted({*moments, 0.15, 0.6})
    assert len(moments) == 6


# --- an agent that is behind --------------------------------------------------------


def test_what_the_agent_is_spared_goes_straight_to_iveg_in_the_same_count() -> None:
    wire = Wire()
    wire.uplink.rates.level = LEVELS
    for tick in range(30):
        wire.uplink.send(odometry(origin=BLANK), Instant(tick / 30, START.wall))
    topics = [topic for topic, _ in wire.sent]
    assert set(topics) == {"/iveg/AGI_odom/attrs", "/AGI/iveg/odom"}
    assert topics.count("/iveg/AGI_odom/attrs") in (5, 6)
    assert len(topics) == 30
    read = [codec.read_measure("AGI_odom", raw).observations for _, raw in wire.sent]
    counted = [one.origin.seq for (one,) in read if isinstance(one, Odometry)]
    assert counted == list(range(1, 31))


@pytest.mark.parametrize(
    ("kind", "device"), [("odometry", "AGI_odom"), ("scan", "AGI_lidar2D")]
)
def test_iveg_reads_that_something_has_no_place_and_places_nothing(
    kind: Literal["odometry", "scan"], device: str
) -> None:
    wire = Wire()
    wire.uplink.send(Unplaced("", BLANK, kind, REST), AT)

    reading = codec.read_measure(device, wire.sent[0][1])

    assert reading.observations == ()
    assert [problem.reason for problem in reading.problems] == ["unplaced"]


# --- how it drives ------------------------------------------------------------------


def test_a_robot_without_a_place_that_is_stopped_is_seen_to_stand() -> None:
    rig = Rig().drive_on()
    rig.odometry = False
    rig.command(stop("01STOP"))

    rig.perform(rig.machine.odometry(None, Twist2D(0.3, 0.0), rig.now))
    braking = rig.state
    rig.perform(rig.machine.odometry(None, REST, rig.now))

    assert (braking, rig.state) == ("BRAKING", "STANDING")


def test_the_robots_own_software_may_only_ask_for_less() -> None:
    rig = Rig().drive_on()

    rig.machine.limit(Cap(0.5, "stale", "flood"))
    rig.run(0.2)
    halved = rig.twist
    rig.machine.limit(Cap(1.0, "clear"))
    rig.run(3.0)

    assert halved.linear_x <= AHEAD.linear_x / 2
    assert rig.twist == AHEAD
