"""Prometheus is told of hops, latency, queues and safety; Grafana draws it."""

import json
import re
from pathlib import Path

import pytest

from iveg.domain.observations import Origin, Received
from iveg.domain.transports import DIRECT
from tests.builders import detection, odometry
from tests.unit.web.api.test_latency import drive
from tests.unit.web.desk import WebDesk

DASHBOARD = Path(__file__).parents[4] / "deploy/grafana/iveg.json"
FIWARE = 'data="odometry",hop="fiware"'
UPLINK = 'data="odometry",hop="uplink"'
AGI = 'robot="AGI"'
SAMPLE = re.compile(r"^(iveg_\w+)(\{[^}]*\})? (\S+)$")


async def busy_desk() -> WebDesk:
    """A desk where everything that is told has happened."""
    desk = WebDesk()
    drive(desk, 10.0)
    told = odometry("AGI", origin=Origin("b", desk.seq + 1))
    desk.ingest.enqueue(Received(told, desk.clock(), DIRECT.id))
    for robot_id, x in (("AGI", 0.0), ("AGII", 50.0)):
        desk.drive(robot_id, x)
        desk.report(robot_id, factor=1.0, reason="clear", linear=0.5)
    desk.look("AGII", detection("farmer", 1.5))
    await desk.wait(0.2)
    desk.report("AGI", factor=0.5, reason="person", linear=0.5)
    desk.health_monitor.sent(Origin("b", 1), desk.clock())
    await desk.wait(1.0)
    desk.health_monitor.received(Origin("b", 1), desk.clock())
    desk.health_monitor.received_at = desk.clock().mono
    return desk


async def told_by(desk: WebDesk) -> str:
    async with desk.program() as program:
        return (await program.get("/metrics")).text


def samples(text: str) -> dict[str, float]:
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    found = [SAMPLE.match(line) for line in lines]
    assert all(found), lines
    return {one[1] + (one[2] or ""): float(one[3]) for one in found if one is not None}


async def test_what_was_measured_is_told() -> None:
    told = samples(await told_by(await busy_desk()))

    expected = {
        f'iveg_latency_seconds{{{FIWARE},quantile="0.95",{AGI}}}': 0.020,
        f'iveg_latency_seconds{{{UPLINK},quantile="0.5",{AGI}}}': 0.004,
        f"iveg_latency_seconds_count{{{FIWARE},{AGI}}}": 200.0,
        f"iveg_latency_seconds_sum{{{FIWARE},{AGI}}}": 4.0,
        'iveg_clock_offset_seconds{robot="AGI"}': 0.0,
        'iveg_queue_depth{queue="ingest"}': 3.0,
        'iveg_dropped_total{queue="history"}': 2.0,
    }
    assert {one: told[one] for one in expected} == pytest.approx(expected, rel=0.02)


async def test_the_dashboard_draws_what_is_told_and_all_of_it() -> None:
    text = await told_by(await busy_desk())
    dashboard = json.loads(DASHBOARD.read_text())
    drawn = " ".join(
        target["expr"] for panel in dashboard["panels"] for target in panel["targets"]
    )

    asked = set(re.findall(r"iveg_\w+", drawn))
    told = {re.sub(r"\{.*", "", name) for name in samples(text)}

    assert asked - told == set()
    assert told - asked == set()
