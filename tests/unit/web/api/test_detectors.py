"""Detectors out of service: who may say so, what it changes, when it ends."""

from typing import Any

import httpx
import pytest

from iveg.domain.detector import OutOfService
from iveg.domain.records import LogRecord
from iveg.web.security.roles import Role
from tests.builders import detection, odometry, origin
from tests.unit.pipeline.desk import conditions_of
from tests.unit.web.desk import WebDesk


async def put(
    desk: WebDesk,
    role: Role = "operator",
    *,
    in_service: object = False,
    robot_id: str = "AGI",
) -> httpx.Response:
    path = f"/api/v1/robots/{robot_id}/detector"
    async with desk.browser(role) as browser:
        return await browser.put(path, json={"in_service": in_service})


def blind() -> WebDesk:
    """AGI and AGII drive 5 m apart; AGI's detector says nothing."""
    desk = WebDesk()
    for robot_id, x in (("AGI", 0.0), ("AGII", 5.0)):
        desk.drive(robot_id, x)
    desk.look("AGII")
    return desk


def factor(desk: WebDesk) -> float:
    return desk.evaluator.speed_limits["AGII"].speed_factor


async def test_out_of_service_nobody_waits_for_its_pictures() -> None:
    desk = blind()
    before = factor(desk)

    answer = await put(desk)
    await desk.wait(0.1)

    assert (before, factor(desk)) == (0.5, 1.0)
    assert answer.status_code == 200
    assert answer.json() == {
        "required": False,
        "missing": False,
        "out_by": "ana",
        "out_since": "2023-11-14T22:13:20.000Z",
        "bias": None,
    }


async def test_it_is_on_the_record_with_its_author_and_a_p3_while_it_lasts() -> None:
    desk = blind()

    await put(desk)
    await desk.wait(0.1)

    lines = [one for one in desk.records(LogRecord) if one.key == "log.detector_out"]
    assert [one.slots for one in lines] == [{"robot": "AGI", "by": "ana"}]
    assert "alert.detector_out_of_service" in conditions_of(desk)


async def test_it_is_kept_for_the_next_start_and_taken_up_there() -> None:
    desk = blind()

    await put(desk)

    word = OutOfService("ana", desk.clock().wall, "boot-a")
    assert desk.detector_store.written == {"AGI": word}


async def test_put_back_in_service_it_is_waited_for_again() -> None:
    desk = blind()
    await put(desk)

    await put(desk, in_service=True)
    await desk.wait(0.1)

    assert factor(desk) == 0.5
    assert desk.detector_store.written == {}
    assert "log.detector_in" in desk.sentences()


async def test_the_robots_next_boot_puts_it_back_and_says_so() -> None:
    desk = blind()
    await put(desk)

    desk.hear(odometry("AGI", origin=origin(1, boot="boot-b")))
    await desk.wait(0.1)

    assert factor(desk) == 0.5
    assert "log.detector_booted" in desk.sentences()


async def test_what_the_disk_does_not_take_changes_nothing() -> None:
    desk = blind()
    desk.detector_store.full = True

    answer = await put(desk)
    await desk.wait(0.1)

    assert answer.status_code == 503
    assert factor(desk) == 0.5


async def test_who_may_not_release_may_not_lift_a_requirement() -> None:
    desk = blind()

    answer = await put(desk, "viewer")
    await desk.wait(0.1)

    assert answer.status_code == 403
    assert factor(desk) == 0.5


async def test_a_robot_that_is_not_in_the_fleet_has_none() -> None:
    assert (await put(WebDesk(), robot_id="AGX")).status_code == 404


async def test_a_word_that_is_no_boolean_is_refused() -> None:
    assert (await put(WebDesk(), in_service="no")).status_code == 422


async def test_a_robot_tells_what_it_lacks() -> None:
    desk = blind()
    await desk.wait(0.1)

    async with desk.browser("viewer") as browser:
        told = (await browser.get("/api/v1/robots/AGII")).json()

    assert told["missing"] == [{"premise": "detector", "robot_id": "AGI"}]
    assert told["speed_limit"]["reason"] == "stale"
    assert told["detector"]["missing"] is False


# --- its mount ------------------------------------------------------------------------


async def bias_of(desk: WebDesk) -> Any:
    async with desk.browser() as browser:
        answer = await browser.get("/api/v1/robots/AGI")
    return answer.json()["detector"]["bias"]


@pytest.mark.parametrize(("off_m", "is_told"), [(0.25, False), (0.35, True)])
async def test_a_camera_that_sees_peers_beside_themselves_is_a_p3(
    off_m: float, is_told: bool
) -> None:
    """AGII backs away from AGI, whose camera has it too far to the left."""
    desk, told = WebDesk(), []
    for number in range(12):
        x = 5.0 + 0.1 * number
        desk.drive("AGI", linear=0.0)
        desk.drive("AGII", x, linear=-0.2)
        # One that is not sure of it counts as well.
        desk.look("AGI", detection("AGII", x, off_m, probability=0.7))
        desk.look("AGII")
        told.append(await bias_of(desk))
        await desk.wait(0.5)

    bias = await bias_of(desk)
    assert told[:9] == [None] * 9
    assert (bias["off_m"], bias["ahead_m"], bias["left_m"]) == (off_m, 0.0, off_m)
    assert bias["looks"] >= 10
    assert bias["last_at"].startswith("2023-11-14T22:13:2")
    assert ("alert.camera_bias" in conditions_of(desk)) is is_told


async def test_somebody_who_is_no_peer_says_nothing_of_a_mount() -> None:
    desk = WebDesk()
    for _ in range(12):
        desk.drive("AGI", linear=0.0)
        desk.drive("AGII", 5.0, linear=0.0)
        desk.look("AGI", detection("farmer", 5.0, 0.4), detection("AGII", 9.0))
        await desk.wait(0.5)

    assert await bias_of(desk) is None


async def test_a_ghost_that_goes_with_its_robot_is_told_and_slows_it_all_the_way() -> (
    None
):
    desk, factors = WebDesk(), set()
    for number in range(24):
        desk.drive("AGI", 0.3 * number, linear=0.6)
        desk.look("AGI", detection("farmer", 0.3 * number + 1.5))
        await desk.wait(0.5)
        factors.add(desk.evaluator.speed_limits["AGI"].speed_factor)

    assert factors == {0.5}
    assert "alert.carried" in conditions_of(desk)
