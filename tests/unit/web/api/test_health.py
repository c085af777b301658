"""What supervisors and Prometheus are told of the chain."""

from iveg.domain.observations import Origin
from tests.builders import at
from tests.unit.web.desk import WebDesk


def whole(desk: WebDesk) -> WebDesk:
    now = desk.clock().mono
    desk.health_monitor.mqtt_connected = True
    desk.health_monitor.orion_ok_at = desk.health_monitor.received_at = (
        desk.health_monitor.notified_at
    ) = now
    return desk


async def test_anybody_may_ask_whether_the_process_answers_and_learns_no_more() -> None:
    async with WebDesk().stranger() as stranger:
        answer = await stranger.get("/healthz")

    assert (answer.status_code, answer.text) == (200, "ok\n")


async def test_ready_is_200_only_when_every_hop_is_well() -> None:
    async with whole(WebDesk()).program() as program:
        well = await program.get("/readyz")
    async with WebDesk().program() as program:
        ill = await program.get("/readyz")

    kept = {"accounts": "ok"}
    assert (well.status_code, well.json()) == (200, {"ok": True} | kept)
    assert (ill.status_code, ill.json()) == (503, {"ok": False} | kept)


async def test_how_late_measures_are_is_told_to_programs_and_to_prometheus() -> None:
    desk = whole(WebDesk())
    for seq, (left, back) in enumerate(((-20.0, 0.0), (-19.0, 4.0))):
        desk.health_monitor.sent(Origin("b", seq), at(left))
        desk.health_monitor.received(Origin("b", seq), at(back))
    async with desk.program() as program:
        agent = (await program.get("/api/v1/health")).json()["hops"][1]
        figures = (await program.get("/metrics")).text.splitlines()

    assert (agent["state"], agent["lag_s"]) == ("late", 23.0)
    assert agent["detail"] == "measures reach Orion 23 s late"
    assert 'iveg_lag_seconds{hop="iot_agent"} 23.0' in figures
