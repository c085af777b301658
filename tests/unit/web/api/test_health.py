"""What supervisors and Prometheus are told of the chain."""

from tests.unit.web.desk import WebDesk


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
