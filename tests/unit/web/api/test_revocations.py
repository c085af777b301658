"""Revoking a robot: STOP first, then silence by any way, and how it ends."""

from typing import Any

import httpx
import pytest

from iveg.domain.observations import Received
from iveg.domain.records import LogRecord
from iveg.domain.revocation import Revocation
from iveg.domain.transports import DIRECT
from iveg.pipeline.revocations import Revocations
from iveg.web.security.roles import Role
from tests.builders import hold, notification, odometry, pose_value
from tests.unit.pipeline.desk import conditions_of
from tests.unit.web.desk import WebDesk


class RobotsDesk(WebDesk):
    """AGI drives; ``obeys``: a STOP makes it stand."""

    def __init__(self, *, obeys: bool = True) -> None:
        super().__init__()
        self.obeys = obeys
        self.heard_at_stop: list[str] = []
        self.drive("AGI", 0.0)
        self.drive("AGII", 5.0)

    async def pause(self, seconds: float) -> None:
        self.heard_at_stop += [robot_id for robot_id, _ in self.fleet.stops]
        if self.obeys:
            held = self.commander.machine("AGI").hold_id or ""
            self.report("AGI", hold(held))
        await self.wait(seconds)


async def ask(
    desk: WebDesk, what: str = "revoke", robot_id: str = "AGI", role: Role = "admin"
) -> httpx.Response:
    async with desk.browser(role) as page:
        return await page.post(f"/api/v1/robots/{robot_id}/{what}")


async def test_a_robot_that_moves_is_stopped_first_and_its_standstill_awaited() -> None:
    desk = RobotsDesk()
    began = desk.clock.now

    answer = await ask(desk)

    assert answer.status_code == 200
    assert answer.json()["revoked"]["stood"] is True
    assert {robot_id for robot_id, _ in desk.fleet.stops} == {"AGI"}
    assert desk.commander.machine("AGI").state == "STANDING"
    assert desk.clock.now - began < 5.0
    assert "log.robot_revoked" in desk.sentences()


async def test_one_that_does_not_confirm_is_out_after_three_seconds_and_told() -> None:
    desk = RobotsDesk(obeys=False)
    began = desk.clock.now

    answer = await ask(desk)

    assert answer.json()["revoked"]["stood"] is False
    assert "AGI" in desk.heard_at_stop
    assert desk.clock.now - began == pytest.approx(3.0, abs=0.1)
    assert "log.robot_revoked_unconfirmed" in desk.sentences()


async def test_nothing_of_it_counts_by_any_way_and_each_message_is_counted() -> None:
    desk = RobotsDesk()
    await ask(desk)
    before = desk.world.robot("AGI").odometry
    x = None if before is None else before.pose.x

    far = odometry("AGI", 50.0, origin=desk.next_origin())
    desk.ingest.enqueue(Received(far, desk.clock(), DIRECT.id))
    async with desk.orion() as orion:
        pose = {"base_pose_ground_truth": pose_value(50.0, seq=900)}
        told = notification(pose, subscription_id="ours")
        await orion.post("/ngsi/notifications", content=told)
    desk.loop.step(list(desk.ingest.drain()), desk.clock())

    now = desk.world.robot("AGI").odometry
    assert now is not None
    assert now.pose.x == x
    assert desk.ingest.counters["rejected.revoked"] == 2
    assert not desk.parts.backfill.has_room("AGI", desk.clock())
    assert desk.parts.backfill.has_room("AGII", desk.clock())


async def test_it_is_shown_as_revoked_ages_like_a_lost_one_and_raises_an_alert() -> (
    None
):
    desk = RobotsDesk()
    await ask(desk)
    await desk.wait(4.0)

    async with desk.browser() as page:
        robot = (await page.get("/api/v1/robots/AGI")).json()

    assert robot["revoked"]["by"] == "ana"
    assert robot["link"] == "LOST"
    situation = robot["situation"]
    assert (situation["level"], situation["state"]) == ("doubt", "lost")
    # Nobody is sent to look at a network that is well.
    assert situation["action"] == "none"
    assert "alert.robot_revoked" in conditions_of(desk)


async def test_stop_still_goes_to_it() -> None:
    desk = RobotsDesk(obeys=False)
    await ask(desk)
    desk.fleet.stops.clear()

    answer = await ask(desk, "stop", role="viewer")

    assert answer.status_code == 202
    assert [robot_id for robot_id, _ in desk.fleet.stops] == ["AGI"]


async def test_who_is_allowed_again_is_heard_and_stays_held() -> None:
    desk = RobotsDesk()
    await ask(desk)

    answer = await ask(desk, "allow")
    desk.drive("AGI", 2.0)

    assert answer.json() == {"robot_id": "AGI", "revoked": None, "broker": "done"}
    assert desk.access.told == [("AGI", False), ("AGI", True)]
    assert desk.revocation_store.written == {}
    assert desk.commander.machine("AGI").hold_id is not None
    assert "log.robot_allowed" in desk.sentences()


async def test_a_full_disk_or_a_broker_that_is_away_keeps_nobody_in() -> None:
    desk = RobotsDesk()
    desk.revocation_store.full = desk.access.away = True

    revoked = await ask(desk)
    allowed = await ask(desk, "allow")

    assert (revoked.status_code, allowed.status_code) == (503, 503)
    assert desk.world.is_revoked("AGI")
    (line,) = [
        one for one in desk.records(LogRecord) if one.key == "log.broker_access_failed"
    ]
    assert line.slots["reason"] == "broker access: no such container"


@pytest.mark.parametrize("role", ["viewer", "operator", "program", "controller"])
async def test_only_an_admin_revokes(role: Any) -> None:
    desk = RobotsDesk()

    answer = await ask(desk, role=role)

    assert answer.status_code == 403
    assert desk.fleet.stops == []


async def test_an_unknown_robot_is_404() -> None:
    assert (await ask(RobotsDesk(), robot_id="AGX")).status_code == 404


def test_it_outlives_a_restart() -> None:
    desk = RobotsDesk()
    kept = {
        "AGII": Revocation("ana", 1.0, stood=True),
        "gone": Revocation("x", 1.0, False),
    }

    Revocations(
        desk.world,
        desk.commander,
        desk.revocation_store,
        desk.access,
        desk.event_log,
        desk.clock,
        kept,
    )

    assert [name for name in ("AGI", "AGII") if desk.world.is_revoked(name)] == ["AGII"]
