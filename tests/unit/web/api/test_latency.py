"""The latency API: the paper's table live, honest about clocks."""

from typing import Any

import pytest

from iveg.domain.observations import FeedbackRef, Origin, Received
from iveg.domain.transports import DIRECT, FIWARE
from tests.builders import START, odometry
from tests.unit.web.desk import WebDesk


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


async def ask(desk: WebDesk, query: str = "") -> dict[str, Any]:
    async with desk.program() as program:
        answer = await program.get(f"/api/v1/latency?{query}")
    assert answer.status_code == 200, answer.text
    body: dict[str, Any] = answer.json()
    return body


def row(told: dict[str, Any], data: str = "odometry") -> dict[str, Any]:
    found: dict[str, Any] = next(one for one in told["rows"] if one["data"] == data)
    return found


async def test_each_hop_is_told_with_its_count_mean_and_quantiles() -> None:
    desk = WebDesk()
    drive(desk, 10.0)

    hops = row(await ask(desk))["hops"]

    assert hops["uplink"]["count"] == 200
    assert hops["uplink"]["mean_ms"] == pytest.approx(4.0, abs=0.2)
    assert hops["fiware"]["p95_ms"] == pytest.approx(20.0, abs=0.3)
    assert hops["robot_orion"]["mean_ms"] == pytest.approx(24.0, abs=0.2)
    assert hops["screen"] == {
        "count": 0,
        **dict.fromkeys(("mean_ms", "p50_ms", "p95_ms", "p99_ms")),
    }
