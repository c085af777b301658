"""One loop, one order: take what came, then let time pass."""

import asyncio
import itertools
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from iveg.domain.observations import (
    HeartbeatProbe,
    Origin,
    Received,
)
from iveg.domain.stream_order import Freshness
from iveg.vital.evaluate import HEARTBEAT_S
from iveg.vital.health_monitor import GRACE_S
from iveg.vital.loop import TICK_S
from tests.builders import detection, detection_frame, odometry, origin
from tests.unit.vital.desk import Desk, settle


@asynccontextmanager
async def running(desk: Desk) -> AsyncIterator[asyncio.Task[None]]:
    """The loop of it, for as long as the test looks."""
    task = asyncio.create_task(desk.loop.run())
    yield task
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


def test_what_is_taken_is_shown_at_once_and_judged_with_the_next_judgement() -> None:
    desk = Desk()
    desk.drive("AGI")
    desk.drive("AGII", 50.0)
    desk.look("AGI")
    near = detection_frame("AGI", detection(x=1.0), origin=desk.next_origin())
    desk.hub.versions.clear()

    desk.loop.take([Received(near, desk.clock())])
    shown, limit = (
        "detections/AGI" in desk.hub.versions,
        desk.evaluator.speed_limits["AGI"],
    )
    desk.loop.step([], desk.clock())

    assert (shown, limit.speed_factor) == (True, 1.0)
    assert desk.evaluator.speed_limits["AGI"].speed_factor == 0.5


async def test_pages_are_shown_what_came_before_the_fleet_is_judged() -> None:
    desk = Desk()
    browser = desk.hub.join()
    desk.ingest.enqueue(Received(odometry(), desk.clock()))
    async with running(desk):
        async with asyncio.timeout(30):
            await browser.news()
        was_unjudged = desk.evaluator.is_unjudged
        assert "robots/AGI" in browser.telemetry
        await settle()

        assert (was_unjudged, desk.evaluator.is_unjudged) == (True, False)


async def test_the_fleet_is_judged_however_much_comes_all_the_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    desk = Desk()
    enqueue, apply = desk.ingest.enqueue, desk.evaluator.apply
    shown = desk.hub.join()
    numbers = itertools.count(1)

    def more(*args: Any) -> Freshness:
        said = odometry(origin=Origin("b", next(numbers)))
        asyncio.get_running_loop().call_soon(enqueue, Received(said, desk.clock()))
        return apply(*args)

    monkeypatch.setattr(desk.evaluator, "apply", more)
    enqueue(Received(odometry(origin=Origin("b", 0)), desk.clock()))
    async with running(desk):
        for _ in range(100):
            await asyncio.sleep(0)

        assert "robots/AGI" in shown.telemetry
        assert desk.fleet.told


def test_heartbeats_keep_their_pace_while_ticks_come_now_late_now_in_time() -> None:
    desk = Desk()
    desk.drive("AGI")
    began, told = desk.clock().mono, len(desk.fleet.told)
    for number in range(40):
        desk.clock.now = began + number * TICK_S + 0.012 * (number % 4 < 2)
        desk.loop.step([], desk.clock())

    heartbeats = (len(desk.fleet.told) - told) / len(desk.evaluator.world.robots)
    assert heartbeats == pytest.approx(40 * TICK_S / HEARTBEAT_S, abs=1)


def test_the_heartbeat_that_came_back_is_evidence_for_the_chain() -> None:
    desk = Desk()
    desk.clock.now = 1.0

    desk.hear(HeartbeatProbe(origin()))

    assert desk.health_monitor.received_at == desk.clock().mono


async def test_a_hop_that_breaks_and_mends_is_told_once_each_time() -> None:
    desk = Desk()
    desk.health_monitor.mqtt_connected = True
    await desk.wait(GRACE_S)
    for is_connected in (False, True):
        desk.health_monitor.mqtt_connected = is_connected
        await desk.wait(1.0)

    lines = desk.event_log.lines
    hops = [line.key for line in lines if line.slots.get("hop") == "mqtt"]
    assert hops == ["log.hop.down", "log.hop.back"]


def test_log_numbers_grow_also_over_a_restart() -> None:
    first, later = Desk(), Desk()
    first.drive("AGI")
    later.event_log._next_id = int(1000 * (first.clock().wall + 10))
    later.drive("AGI")

    assert later.event_log.lines[0].id > first.event_log.lines[-1].id
