"""Prometheus is told of hops, latency, loss, queues and safety; Grafana draws it."""

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
AGI = 'robot="AGI",data="odometry"'
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
    desk.counters.update({"near_s.slow": 3, "near_s.fast": 1})
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


async def test_every_line_is_a_sample_of_a_family_with_type_and_help() -> None:
    text = await told_by(await busy_desk())

    families = set(re.findall(r"^# TYPE (\w+)", text, re.M))
    helped = set(re.findall(r"^# HELP (\w+)", text, re.M))
    named = {re.sub(r"\{.*", "", name) for name in samples(text)}
    summed = {f"iveg_latency_seconds_{end}" for end in ("sum", "count")}

    assert families == helped
    assert named - summed <= families
    assert len(samples(text)) == sum(
        not line.startswith("#") for line in text.split("\n") if line
    )


@pytest.mark.parametrize(
    ("sample", "value"),
    [
        (f'iveg_latency_seconds{{{AGI},hop="fiware",quantile="0.95"}}', 0.020),
        (f'iveg_latency_seconds{{{AGI},hop="uplink",quantile="0.5"}}', 0.004),
        (f'iveg_latency_seconds_count{{{AGI},hop="fiware"}}', 200.0),
        (f'iveg_latency_seconds_sum{{{AGI},hop="fiware"}}', 4.0),
        (f'iveg_messages_excluded_total{{{AGI},hop="uplink",reason="no_stamp"}}', 1.0),
        ('iveg_clock_offset_seconds{robot="AGI"}', 0.0),
        ('iveg_queue_depth{queue="ingest"}', 3.0),
        ('iveg_dropped_total{queue="history"}', 2.0),
        ('iveg_retries_total{what="stop_send"}', 1.0),
        ("iveg_protection_ratio", 0.75),
    ],
)
async def test_what_was_measured_is_told(sample: str, value: float) -> None:
    told = samples(await told_by(await busy_desk()))

    assert told[sample] == pytest.approx(value, rel=0.02)


async def test_the_safety_tiles_are_told() -> None:
    told = samples(await told_by(await busy_desk()))

    assert told["iveg_alerts_asked"] == 1.0
    assert told["iveg_alerts_not_echoed"] == 0.0
    assert told['iveg_alert_latency_seconds{quantile="0.5"}'] == pytest.approx(
        0.2, abs=0.1
    )
    assert "iveg_worst_margin_metres" in told


async def test_a_summary_never_forgets_what_it_has_counted() -> None:
    desk = await busy_desk()
    name = f'iveg_latency_seconds_count{{{AGI},hop="fiware"}}'
    before = samples(await told_by(desk))[name]

    await desk.wait(120.0)

    assert samples(await told_by(desk))[name] == before


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


async def test_the_dashboard_asks_for_labels_that_exist() -> None:
    text = await told_by(await busy_desk())
    dashboard = json.loads(DASHBOARD.read_text())
    targets = [one for panel in dashboard["panels"] for one in panel["targets"]]

    legends = " ".join(one["legendFormat"] for one in targets)
    asked = " ".join(one["expr"] for one in targets)
    wanted = set(re.findall(r"\{\{(\w+)\}\}", legends))
    wanted |= set(re.findall(r"[{,](\w+)(?:=|!)", asked))
    known = set(re.findall(r"[{,](\w+)=\"", text))

    assert wanted - known == set()
