"""Detections, and what operators say of detectors, their words and whom they see.

What they say counts at once, is kept, on the record, and asked for twice where it frees
robots.
"""

import httpx
import pytest

from iveg.domain.detector import OutOfService, WordAnswer
from iveg.domain.records import DetectionRecord, LogRecord
from iveg.vital.operators import Detectors
from tests.builders import START, detection
from tests.unit.vital.desk import conditions_of
from tests.unit.web.desk import WebDesk

LATEST = "/api/v1/detections/latest"


def factor(desk: WebDesk) -> float:
    return desk.evaluator.speed_limits["AGII"].speed_factor


# --- each detection of the last moments -------------------------------------------


@pytest.fixture
def desk() -> WebDesk:
    """A farmer whom AGII sees ten times in a second, and a box of no class."""
    desk = WebDesk()
    desk.drive("AGI", 0.0)
    desk.drive("AGII", 50.0)
    for tenth in range(10):
        desk.clock.now = round(desk.clock.now + 0.1, 6)
        farmer = detection("farmer", 20.0, probability=0.8 + 0.01 * tenth)
        desk.look("AGII", farmer, detection("cat", 22.0, probability=0.3))
    return desk


async def test_each_detection_is_told_newest_first_with_source_class_and_confidence(
    desk: WebDesk,
) -> None:
    async with desk.program() as program:
        rows = (await program.get(f"{LATEST}?class=person")).json()["items"]
        few = (await program.get(f"{LATEST}?robot=AGII&limit=3")).json()["items"]
        sure = (await program.get(f"{LATEST}?min_probability=0.875")).json()["items"]

    assert [one["probability"] for one in rows] == [
        pytest.approx(0.89 - 0.01 * n) for n in range(10)
    ]
    assert {(one["robot_id"], one["class"], one["class_id"]) for one in rows} == {
        ("AGII", "person", "farmer")
    }
    assert len({one["at"] for one in rows}) == 10
    # What the history keeps of the same second is less.
    assert len(desk.records(DetectionRecord)) < 10
    assert (len(few), len(sure)) == (3, 2)


# --- detectors out of service -----------------------------------------------------


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


# --- words that nobody knew -------------------------------------------------------


async def say(desk: WebDesk, **said: object) -> httpx.Response:
    body = {"detector": "AGI", "word": "tractor", "is_person": True, **said}
    async with desk.browser() as browser:
        return await browser.put("/api/v1/words", json=body)


def asking() -> WebDesk:
    """AGI and AGII are 10 m apart; AGI's detector says a word that nobody knows."""
    desk = WebDesk()
    for robot_id, x in (("AGI", 0.0), ("AGII", 10.0)):
        desk.drive(robot_id, x, linear=0.0)
        desk.look(robot_id, detection("tomato", 4.0))
    desk.look("AGI", detection("tractor", 9.0))
    return desk


async def test_that_it_is_no_person_is_asked_twice() -> None:
    desk = asking()

    once = await say(desk, is_person=False)
    assert once.status_code == 422
    assert desk.word_store.written == {}

    twice = await say(desk, is_person=False, sure=True)
    assert twice.status_code == 204


async def test_a_word_for_a_person_has_a_ring_on_the_record_and_after_a_restart() -> (
    None
):
    desk = asking()

    answer = await say(desk)
    desk.look("AGI", detection("tractor_2", 9.0))

    assert answer.status_code == 204
    assert desk.evaluator.speed_limits["AGII"].reason == "person"
    assert desk.world.robot("AGI").detector.words["AGI"].unknown == {}
    lines = [one for one in desk.records(LogRecord) if one.key == "log.word_person"]
    said = {"word": "tractor", "detector": "AGI", "by": "ana"}
    assert [one.slots for one in lines] == [said]
    kept = WordAnswer("AGI", "tractor", True, "ana", desk.clock().wall)
    assert desk.word_store.written == {"AGI/tractor": kept}
    anew = WebDesk()
    Detectors(anew.parts.core, desk.choices.kept)
    assert anew.world.word_answers.meanings("AGI") == {"tractor": True}


async def test_nobody_answers_what_was_not_asked() -> None:
    desk = asking()

    known = await say(desk, word="person", is_person=False, sure=True)
    of_another = await say(desk, detector="AGII")

    assert (known.status_code, of_another.status_code) == (404, 404)


# --- marks "not a person here" ----------------------------------------------------


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
