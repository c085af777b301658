"""What operators say of detectors' words: at once, asked twice, kept, on the record."""

import httpx

from iveg.domain.records import LogRecord
from iveg.domain.words import WordAnswer
from iveg.vital.operators import Detectors
from tests.builders import detection
from tests.unit.web.desk import WebDesk


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
    assert anew.world.word_answers.is_person("AGI", "tractor") is True


async def test_nobody_answers_what_was_not_asked() -> None:
    desk = asking()

    known = await say(desk, word="person", is_person=False, sure=True)
    of_another = await say(desk, detector="AGII")

    assert (known.status_code, of_another.status_code) == (404, 404)
