"""What supervisors and Prometheus are told of the chain; Grafana draws it."""

import json
import re
from pathlib import Path

import pytest

from iveg.domain.observations import FeedbackRef, Origin, Received
from iveg.domain.transports import DIRECT, FIWARE
from tests.builders import START, detection, odometry
from tests.unit.web.desk import WebDesk

DASHBOARD = Path(__file__).parents[4] / "deploy/grafana/iveg.json"
BY_FIWARE = 'data="odometry",hop="fiware"'
UPLINK = 'data="odometry",hop="uplink"'
AGI = 'robot="AGI"'
SAMPLE = re.compile(r"^(iveg_\w+)(\{[^}]*\})? (\S+)$")


def whole(desk: WebDesk) -> WebDesk:
    now = desk.clock().mono
    desk.health_monitor.mqtt_connected = True
    desk.health_monitor.orion_ok_at = desk.health_monitor.received_at = (
        desk.health_monitor.notified_at
    ) = now
    return desk


async def test_ready_is_200_when_every_hop_is_well_and_strangers_learn_no_more() -> (
    None
):
    async with whole(WebDesk()).program() as program:
        well = await program.get("/readyz")
    desk = WebDesk()
    async with desk.program() as program, desk.stranger() as stranger:
        ill = await program.get("/readyz")
        alive = await stranger.get("/healthz")

    assert (alive.status_code, alive.text) == (200, "ok\n")
    kept = {"accounts": "ok"}
    assert (well.status_code, well.json()) == (200, {"ok": True} | kept)
    assert (ill.status_code, ill.json()) == (503, {"ok": False} | kept)


def drive(desk: WebDesk, seconds: float) -> None:
    """AGI sends twenty messages a second: 4 ms to the broker, 20 ms more to Orion."""
    for _ in range(round(20 * seconds)):
        desk.seq += 1
        desk.clock.now = round(desk.clock.now + 0.05, 6)
        stamp = START.wall + desk.clock.now - 0.004
        heard = FeedbackRef("iveg", desk.seq)
        desk.world.ledger.composed("iveg", desk.seq, desk.seq, desk.clock().mono - 0.01)
        origin = Origin("b", desk.seq, "2023", stamp, None, True, heard)
        told = odometry("AGI", origin=origin)
        desk.ingest.enqueue(Received(told, desk.clock(), DIRECT.id))
        desk.ingest.enqueue(Received(told, desk.clock().later(0.020), FIWARE.id))
        desk.loop.step(desk.ingest.drain(), desk.clock())


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
    desk.health_monitor.probe.sent(Origin("b", 1), desk.clock())
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
        f'iveg_latency_seconds{{{BY_FIWARE},quantile="0.95",{AGI}}}': 0.020,
        f'iveg_latency_seconds{{{UPLINK},quantile="0.5",{AGI}}}': 0.004,
        f"iveg_latency_seconds_count{{{BY_FIWARE},{AGI}}}": 200.0,
        f"iveg_latency_seconds_sum{{{BY_FIWARE},{AGI}}}": 4.0,
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
