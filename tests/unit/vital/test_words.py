"""Words that nobody knows: who is slow for them, and who is asked."""

import pytest

from iveg.domain.detector import WordAnswer
from tests.builders import detection
from tests.unit.vital.desk import Desk, conditions_of
from tests.unit.vital.test_frames import factors, parked

UNKNOWN, HARMLESS = "alert.unknown_word", "alert.harmless_word"


def words_asked(desk: Desk) -> list[tuple[object, object]]:
    return [
        (one.condition.slots["detector"], one.condition.slots["word"])
        for one in desk.evaluator.alerts.waiting
        if one.condition.key == UNKNOWN
    ]


@pytest.mark.parametrize("word", ["0", "", "class_7", "17"])
def test_a_number_or_nothing_as_class_is_a_frame_not_whole(word: str) -> None:
    desk = parked()

    desk.look("AGI", detection(word, 4.0))

    assert factors(desk) == [0.5, 0.5]


async def test_an_unknown_word_is_asked_once_and_slows_nobody_where_others_are() -> (
    None
):
    desk = parked()
    desk.look("AGI", detection("tomato", 4.0))

    for turn in range(3):
        desk.look("AGI", detection(f"tractor_{turn}", 4.0))
    desk.look("AGI", detection("maybe", 4.0, probability=0.5))
    await desk.wait(0.1)

    assert factors(desk) == [1.0, 1.0]
    assert words_asked(desk) == [("AGI", "tractor")]


def test_the_name_of_a_robot_of_the_fleet_is_a_word_that_is_known() -> None:
    desk = Desk(("R1", "R2"))
    for number, robot_id in enumerate(("R1", "R2")):
        desk.drive(robot_id, 10.0 * number, linear=0.0)
        desk.look(robot_id, detection("R2", 20.0))

    assert factors(desk) == [1.0, 1.0]


def test_a_detector_that_says_only_unknown_words_clears_nobody() -> None:
    desk = parked()
    desk.look("AGI", detection("tractor", 4.0))
    assert factors(desk) == [0.5, 0.5]

    # Nor does it with an empty frame, until one of its words is understood.
    desk.look("AGI")
    assert factors(desk) == [0.5, 0.5]
    desk.clock.now = 1.01
    for robot_id, x in (("AGI", 0.0), ("AGII", 10.0)):
        desk.drive(robot_id, x, linear=0.0)
        desk.look(robot_id, detection(x=-90.0))

    assert factors(desk) == [1.0, 1.0]


def test_what_is_said_to_be_a_person_has_a_ring_for_that_detector_alone() -> None:
    desk = parked()
    desk.world.word_answers.add(WordAnswer("AGII", "abuela", True, "ana", 0.0))

    desk.look("AGII", detection("Abuela_1", 1.0))
    assert desk.evaluator.speed_limits["AGI"].reason == "person"

    other = parked()
    other.world.word_answers.add(WordAnswer("AGII", "abuela", True, "ana", 0.0))
    other.look("AGI", detection("Abuela_1", 1.0))
    assert other.evaluator.people.known == {}


async def test_what_is_said_to_be_no_person_stands_as_a_notice() -> None:
    desk = parked()
    desk.world.word_answers.add(WordAnswer("AGI", "tractor", False, "ana", 0.0))

    desk.look("AGI", detection("tractor", 4.0))
    await desk.wait(0.1)

    assert factors(desk) == [1.0, 1.0]
    assert HARMLESS in conditions_of(desk)
    assert words_asked(desk) == []


def test_a_robot_that_invents_words_is_asked_of_sixteen_at_most() -> None:
    desk = parked()

    for turn in range(100):
        desk.clock.now += 0.05
        desk.look("AGI", detection("thing" + "x" * turn, 4.0))

    assert len(desk.world.robot("AGI").detector.words["AGI"].unknown) == 16
