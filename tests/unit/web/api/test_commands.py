"""STOP for everybody who is signed in; release and resume for those who may."""

import pytest

from iveg.domain.events import Condition
from iveg.domain.records import AlertRecord
from iveg.web.security.roles import Role
from tests.unit.vital.desk import settle
from tests.unit.web.desk import WebDesk


@pytest.mark.parametrize(
    ("role", "after_s", "releases"),
    [
        ("viewer", 0.0, 403),
        ("operator", 0.0, 409),
        ("admin", 0.0, 409),
        # The session is over.
        ("operator", 13 * 3600.0, 403),
    ],
)
async def test_i8_i11_everybody_who_was_let_in_may_stop_and_operators_release(
    role: Role, after_s: float, releases: int
) -> None:
    desk = WebDesk()
    async with desk.browser(role) as browser:
        desk.clock.now += after_s
        answer = await browser.post("/api/v1/robots/AGI/stop")
        released = await browser.post(
            "/api/v1/robots/AGI/release", json={"holds": ["another"]}
        )

    # What an operator is refused for is that the robot does not stand yet.
    assert released.status_code == releases
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


async def test_an_operator_releases_the_holds_that_were_seen_and_then_resumes() -> None:
    desk = WebDesk()
    (command,) = await desk.commander.stop(["AGI"], "ana", desk.clock())
    await settle()
    await desk.stand()
    held = command.command_id
    path = "/api/v1/robots/AGI/release"
    async with desk.browser() as browser:
        changed = await browser.post(path, json={"holds": ["another"]})
        answer = await browser.post(path, json={"holds": [held]})
        await settle()
        asked = desk.broker.asked[-1]
        desk.report("AGI", released=(held,))
        resumed = await browser.post("/api/v1/robots/AGI/resume")

    assert changed.status_code == 409
    assert "the holds changed" in changed.text
    assert (answer.status_code, resumed.status_code) == (202, 202)
    assert answer.json()["state"] == "RELEASING"
    assert asked == ("release", "AGI", (held,))


async def test_a_flood_is_acknowledged_together_but_none_of_its_p1s() -> None:
    desk = WebDesk()
    alerts = desk.evaluator.alerts
    flood = [
        Condition("P1", "alert.moving_robot_lost", "AGI", "AGI"),
        Condition("P2", "alert.robot_lost", "AGII", "AGII"),
        Condition("P3", "alert.battery_low", "AGII", "AGII"),
    ]
    alerts.sync(flood, desk.clock())
    ids = {one.priority: one.alert_id for one in alerts.waiting}
    body = {"alert_ids": [*ids.values(), "gone"], "note": "going\u202e there"}
    async with desk.browser() as browser:
        told = (await browser.post("/api/v1/alerts/acknowledge", json=body)).json()
        again = (await browser.post("/api/v1/alerts/acknowledge", json=body)).json()

    assert {one["priority"] for one in told["items"]} == {"P2", "P3"}
    said = {(one["acknowledged_by"], one["note"]) for one in told["items"]}
    assert said == {("ana", "going there")}
    assert told["left"] == [ids["P1"], "gone"]
    assert again["items"] == []
    assert desk.sentences().count("log.alert.acknowledged") == 2
    stored = {one.alert_id: one.acknowledged_by for one in desk.records(AlertRecord)}
    assert stored == {ids["P1"]: None, ids["P2"]: "ana", ids["P3"]: "ana"}
