"""Detectors out of service: who may say so, what it changes, when it ends."""

import httpx
import pytest

from iveg.domain.detector import OutOfService
from iveg.domain.records import LogRecord
from tests.builders import START
from tests.unit.vital.desk import conditions_of
from tests.unit.web.desk import WebDesk


async def put(
    desk: WebDesk, *, in_service: bool = False, reason: str = "lens broken"
) -> httpx.Response:
    path = "/api/v1/robots/AGI/detector"
    async with desk.browser() as browser:
        body = {"in_service": in_service, "reason": reason}
        return await browser.put(path, json=body)


def blind() -> WebDesk:
    """AGI and AGII drive 5 m apart; AGI's detector says nothing."""
    desk = WebDesk()
    for robot_id, x in (("AGI", 0.0), ("AGII", 5.0)):
        desk.drive(robot_id, x)
    desk.look("AGII")
    return desk


def factor(desk: WebDesk) -> float:
    return desk.evaluator.speed_limits["AGII"].speed_factor


async def test_out_of_service_nobody_waits_for_it_until_it_is_put_back() -> None:
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
        "out_reason": "lens broken",
    }
    said = {"by": "ana", "reason": "lens broken"}
    word = OutOfService("ana", START.wall, "boot-a", "lens broken")
    assert desk.detector_store.written == {"AGI": word}
    lines = [one for one in desk.records(LogRecord) if one.key == "log.detector_out"]
    assert [one.slots for one in lines] == [{"robot": "AGI", **said}]
    assert "alert.detector_out_of_service" in conditions_of(desk)

    await put(desk, in_service=True)
    await desk.wait(0.1)

    assert factor(desk) == 0.5
    assert desk.detector_store.written == {}
    assert "log.detector_in" in desk.sentences()


@pytest.mark.parametrize("reason", ["", "   ", "\u200b"])
async def test_without_a_reason_it_stays_in_service(reason: str) -> None:
    desk = blind()

    answer = await put(desk, reason=reason)

    assert (answer.status_code, factor(desk)) == (422, 0.5)
    assert desk.detector_store.written == {}


async def test_what_the_disk_does_not_take_changes_nothing() -> None:
    desk = blind()
    desk.detector_store.full = True

    answer = await put(desk)
    await desk.wait(0.1)

    assert answer.status_code == 503
    assert factor(desk) == 0.5
