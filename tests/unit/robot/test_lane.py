"""Disk before answer, answers in order, the newest report."""

import asyncio
import contextlib
import logging
import threading
from collections.abc import AsyncIterator, Callable

import pytest

from iveg.domain.errors import HopError
from iveg.domain.observations import Hold
from iveg.robot.holds import HoldSet
from iveg.robot.lane import LaneMessage, SafetyLane

FIRST = HoldSet((Hold("01A", "iveg", "remote"),))
SECOND = HoldSet((Hold("01B", "iveg", "remote"),))


async def until(true: Callable[[], bool]) -> None:
    deadline = asyncio.get_running_loop().time() + 30
    while not true():
        assert asyncio.get_running_loop().time() < deadline
        await asyncio.sleep(0.001)


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
    return LaneMessage("t", text.encode())


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


async def test_of_several_sets_the_newest_is_kept_and_every_answer_sent() -> None:
    world = World()
    lane = world.lane
    lane.persist(FIRST)
    lane.answer(message("1"))
    lane.persist(SECOND)
    lane.answer(message("2"))
    async with world.running():
        await world.until_seen(3)
    assert world.seen == [SECOND, b"1", b"2"]


async def test_the_newest_report_takes_the_place_of_one_that_waits() -> None:
    world = World()
    world.lane.report(message("old"))
    world.lane.report(message("new"))
    async with world.running():
        await world.until_seen(1)
    assert world.seen == [b"new"]


async def test_a_full_disk_is_told_once_and_does_not_silence_the_robot(
    caplog: pytest.LogCaptureFixture,
) -> None:
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
    assert [record.levelno for record in caplog.records] == [logging.WARNING] * 2


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


async def test_reports_wait_for_no_confirmation_of_the_one_before() -> None:
    world = World()
    world.confirms.clear()
    async with world.running() as lane:
        for number in range(5):
            lane.report(message(str(number)))
            await world.until_seen(number + 1)
    assert world.seen == [b"0", b"1", b"2", b"3", b"4"]


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
