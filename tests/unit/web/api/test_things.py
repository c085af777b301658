"""Marks "not a person here": who may make them, what they change, when they end."""

import httpx
import pytest

from iveg.domain.records import LogRecord
from tests.builders import detection
from tests.unit.vital.desk import conditions_of
from tests.unit.web.desk import WebDesk


def see(desk: WebDesk, *xs: float, confidence: float = 0.85) -> None:
    """AGI sees somebody at each place in turn; AGII stands 1.5 m beside the first."""
    for x in xs:
        desk.clock.now += 0.1
        desk.drive("AGI", 0.0, linear=0.0)
        desk.drive("AGII", 6.5, linear=0.0)
        desk.look("AGII")
        desk.look("AGI", detection("farmer", x, probability=confidence))


async def mark(desk: WebDesk, person_id: object = "P1") -> httpx.Response:
    async with desk.browser() as browser:
        return await browser.post("/api/v1/things", json={"person_id": person_id})


async def unmark(desk: WebDesk, thing_id: str) -> httpx.Response:
    async with desk.browser() as browser:
        return await browser.delete(f"/api/v1/things/{thing_id}")


async def listed(desk: WebDesk, path: str) -> list[dict[str, object]]:
    async with desk.browser("viewer") as browser:
        answer = await browser.get(f"/api/v1/{path}")
    items: list[dict[str, object]] = answer.json()["items"]
    return items


def factor(desk: WebDesk) -> float:
    return desk.evaluator.speed_limits["AGII"].speed_factor


async def test_a_mark_frees_robots_is_a_notice_on_record_and_can_be_taken_back() -> (
    None
):
    desk = WebDesk()
    see(desk, 5.0)
    before = factor(desk)

    answer = await mark(desk)
    see(desk, *([5.0] * 12))

    assert answer.status_code == 201
    thing = answer.json()
    assert thing == {
        "thing_id": thing["thing_id"],
        "kind": "person",
        "x": 5.0,
        "y": 0.0,
        "radius_m": 0.5,
        "by": "ana",
        "since": "2023-11-14T22:13:20.100Z",
        "until": "2023-11-14T23:00:00.000Z",
    }
    assert (before, factor(desk)) == (0.5, 1.0)
    assert "alert.thing_marked" in conditions_of(desk)
    assert await listed(desk, "things") == [thing]
    (somebody,) = await listed(desk, "people")
    assert (somebody["thing_id"], somebody["radius_m"]) == (thing["thing_id"], None)
    assert desk.fleet.told[-1].alerts == ()

    taken_back = await unmark(desk, thing["thing_id"])
    see(desk, 5.0)
    await desk.wait(0.1)

    assert taken_back.status_code == 200
    assert factor(desk) == 0.5
    assert await listed(desk, "things") == []
    assert "alert.thing_marked" not in conditions_of(desk)
    told = [one for one in desk.records(LogRecord) if one.key.startswith("log.thing")]
    assert [one.key for one in told] == ["log.thing_marked", "log.thing_unmarked"]
    assert told[0].slots == {"by": "ana", "x": 5.0, "y": 0.0}


@pytest.mark.parametrize(
    ("places", "confidence"),
    [((5.0, 5.3, 5.6, 5.9, 6.2), 0.85), ((5.0,), 0.95)],
    ids=["moves", "surely seen"],
)
async def test_somebody_is_not_marked(
    places: tuple[float, ...], confidence: float
) -> None:
    desk = WebDesk()
    see(desk, *places, confidence=confidence)

    answer = await mark(desk)

    assert (answer.status_code, answer.json()["why"]) == (409, "somebody")
    assert factor(desk) == 0.5


async def test_there_is_a_bound_of_marks() -> None:
    desk = WebDesk()
    see(desk, 5.0)
    for _ in range(32):
        await mark(desk)

    answer = await mark(desk)

    assert (answer.status_code, answer.json()["why"]) == (409, "too_many")


async def test_what_is_not_known_is_not_found_and_nonsense_is_refused() -> None:
    desk = WebDesk()

    assert (await mark(desk, person_id="P9")).status_code == 404
    assert (await unmark(desk, "T9")).status_code == 404
    assert (await mark(desk, person_id=9)).status_code == 422
