"""STOP for everybody who is signed in; release and resume for those who may."""

import pytest

from iveg.domain.events import Condition
from iveg.domain.records import AlertRecord
from iveg.web.security.roles import Role
from tests.unit.vital.desk import settle
from tests.unit.web.desk import WebDesk


async def stopped(desk: WebDesk) -> str:
    """AGI stands, held by iVeg; returns the hold."""
    (command,) = await desk.commander.stop(["AGI"], "ana", desk.clock())
    await settle()
    await desk.stand()
    return command.command_id


@pytest.mark.parametrize("role", ["viewer", "operator", "admin", "expired"])
async def test_i8_i11_everybody_who_was_let_in_may_stop(role: Role) -> None:
    desk = WebDesk()
    if_expired = {"expired": 13 * 3600.0}.get(role, 0.0)
    signed_in: dict[str, Role] = {"expired": "operator"}
    async with desk.browser(signed_in.get(role, role)) as browser:
        desk.clock.now += if_expired
        answer = await browser.post("/api/v1/robots/AGI/stop")

    assert answer.status_code == 202
    machine = desk.commander.machine("AGI")
    assert answer.json() == {
        "robot_id": "AGI",
        "command_id": machine.hold_id,
        "state": machine.state,
    }
    assert desk.fleet.stops == [("AGI", machine.hold_id)]


async def test_i11_stop_has_no_rate_limit() -> None:
    desk = WebDesk()
    async with desk.browser() as browser:
        answers = [
            (await browser.post("/api/v1/robots/AGI/stop")).status_code
            for _ in range(100)
        ]

    assert set(answers) == {202}
    assert len({hold for _, hold in desk.fleet.stops}) == 1


async def test_an_operator_releases_the_holds_that_were_seen() -> None:
    desk = WebDesk()
    held = await stopped(desk)
    async with desk.browser() as browser:
        answer = await browser.post(
            "/api/v1/robots/AGI/release", json={"holds": [held]}
        )

    assert answer.status_code == 202
    assert answer.json()["state"] == "RELEASING"
    await settle()
    assert desk.broker.asked[-1] == ("release", "AGI", (held,))


async def test_a_set_of_holds_that_changed_is_409_with_the_reason() -> None:
    desk = WebDesk()
    await stopped(desk)
    async with desk.browser() as browser:
        answer = await browser.post(
            "/api/v1/robots/AGI/release", json={"holds": ["another"]}
        )

    assert answer.status_code == 409
    assert "the holds changed" in answer.text


async def test_a_released_robot_is_resumed() -> None:
    desk = WebDesk()
    held = await stopped(desk)
    await desk.commander.release("AGI", [held], "ana", desk.clock())
    desk.report("AGI", released=(held,))
    async with desk.browser() as browser:
        answer = await browser.post("/api/v1/robots/AGI/resume")

    assert answer.status_code == 202


async def lost(desk: WebDesk) -> str:
    """A moving robot is lost; returns the alert's id."""
    desk.drive("AGI")
    await desk.wait(3.2)
    (alert,) = desk.evaluator.alerts.waiting
    return alert.alert_id


async def test_an_alert_is_acknowledged_with_who_and_a_clean_note() -> None:
    desk = WebDesk()
    alert_id = await lost(desk)
    async with desk.browser() as browser:
        answer = await browser.post(
            f"/api/v1/alerts/{alert_id}/acknowledge", json={"note": "going\u202e there"}
        )

    told = answer.json()
    assert answer.status_code == 200
    assert (told["acknowledged_by"], told["note"]) == ("ana", "going there")
    assert told["cleared_at"] is None


async def test_a_flood_is_acknowledged_together_but_none_of_its_p1s() -> None:
    desk = WebDesk()
    alerts = desk.evaluator.alerts
    flood = [
        Condition("P1", "alert.moving_robot_lost", "AGI", "AGI"),
        Condition("P2", "alert.robot_lost", "AGII", "AGII"),
        Condition("P3", "alert.battery_low", "AGII", "AGII"),
    ]
    alerts.sync(flood, desk.clock())
    asked = [one.alert_id for one in alerts.waiting]
    by_priority = {one.priority: one.alert_id for one in alerts.waiting}
    body = {"alert_ids": [*asked, "gone"], "note": "seen"}
    async with desk.browser() as browser:
        told = (await browser.post("/api/v1/alerts/acknowledge", json=body)).json()
        again = (await browser.post("/api/v1/alerts/acknowledge", json=body)).json()

    assert {one["priority"] for one in told["items"]} == {"P2", "P3"}
    assert {(one["acknowledged_by"], one["note"]) for one in told["items"]} == {
        ("ana", "seen")
    }
    assert told["left"] == [by_priority["P1"], "gone"]
    assert again["items"] == []
    assert desk.sentences().count("log.alert.acknowledged") == 2
    stored = {one.alert_id: one.acknowledged_by for one in desk.records(AlertRecord)}
    assert stored == {
        by_priority["P1"]: None,
        by_priority["P2"]: "ana",
        by_priority["P3"]: "ana",
    }
