"""From when an answer is timed, through the whole loop and with delays."""

import pytest

from iveg.domain.alerts import Acknowledgements, acknowledgements_of
from iveg.domain.observations import Observation, Received
from iveg.domain.transports import DIRECT
from tests.builders import detection, detection_frame, odometry, origin, safety_report
from tests.unit.vital.desk import Desk

DELAY_S = 0.03


class LateDesk(Desk):
    """Messages of the robots arrive ``DELAY_S`` after they were stamped."""

    def arrive(self, observation: Observation) -> None:
        self.loop.step([Received(observation, self.clock(), DIRECT.id)], self.clock())

    def told(self) -> Acknowledgements:
        return acknowledgements_of(self.evaluator.live_decisions(), self.clock())


async def _near_a_person(x: float) -> LateDesk:
    """AGII has seen a farmer at the origin; AGI is ``x`` metres from there, clear."""
    desk = LateDesk()
    for seq, (robot_id, place) in enumerate((("AGI", x), ("AGII", 6.0)), 1):
        # One message without delay calibrates the clocks.
        desk.arrive(odometry(robot_id, place, origin=origin(seq, after=0.0)))
        desk.arrive(
            safety_report(
                robot_id,
                speed_factor=1.0,
                reason="clear",
                linear=0.5,
                origin=origin(seq, after=0.0),
            )
        )
    await desk.wait(0.2)
    return desk


def _look(desk: LateDesk, seq: int) -> None:
    stamped = origin(seq, after=desk.clock.now - DELAY_S)
    desk.arrive(detection_frame("AGII", detection("farmer", 0.0), origin=stamped))


def _report(desk: LateDesk, seq: int, decision_id: str | None) -> None:
    desk.arrive(
        safety_report(
            "AGI",
            speed_factor=0.5,
            reason="person",
            linear=0.5,
            decision_id=decision_id,
            origin=origin(seq, after=desk.clock.now - DELAY_S),
        )
    )


async def test_a_look_that_was_on_its_way_for_a_while_is_timed_from_its_arrival() -> (
    None
):
    desk = await _near_a_person(1.0)
    _look(desk, 10)
    await desk.wait(0.1)
    _report(desk, 11, None)

    told = desk.told()

    assert told.timed == 1
    assert told.p50_s == pytest.approx(0.1, abs=1e-6)


async def test_a_robot_that_judges_ahead_is_timed_from_the_look_it_was_told_of() -> (
    None
):
    desk = await _near_a_person(2.4)
    _look(desk, 10)
    await desk.wait(0.25)
    _look(desk, 11)
    await desk.wait(0.2)
    (person,) = desk.evaluator.people.known.values()
    _report(desk, 12, person.decision_id)
    await desk.wait(0.05)
    desk.arrive(odometry("AGI", 1.9, origin=origin(13, after=desk.clock.now)))

    told = desk.told()

    assert (told.timed, told.asked, told.missed) == (1, 1, 0)
    assert told.p50_s == pytest.approx(0.2, abs=1e-6)
