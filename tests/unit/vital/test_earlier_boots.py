"""Reports of an earlier boot, or of unknown age, that FIWARE brings late: none acts."""

from dataclasses import replace

import pytest

from iveg.domain.observations import FeedbackRef, HeartbeatProbe, Hold, Origin
from iveg.domain.transports import FIWARE
from tests.builders import origin, safety_report
from tests.unit.vital.desk import Desk

BEFORE = Hold("01BEFORE", "iveg", "remote")


class Robot:
    """AGI, which FIWARE alone connects.

    Attributes:
        heard: What it echoes, where it is not iVeg's newest feedback.
        echoes: Whether it tells what it heard at all.
    """

    def __init__(
        self, desk: Desk, *, heard: FeedbackRef | None = None, echoes: bool = True
    ) -> None:
        self.desk, self.heard, self.echoes = desk, heard, echoes
        self._seq = 0

    def _origin(self) -> Origin:
        self._seq += 1
        now = self.desk.clock.now
        said = origin(self._seq, after=now - 0.1)
        if not self.echoes:
            return said
        told = self.desk.fleet.told[-1].origin
        heard = self.heard or FeedbackRef(told.boot or "", told.seq or 0)
        return replace(said, mono=500.0 + now, acknowledgements=True, heard=heard)

    def report(self, *holds: Hold) -> None:
        self.desk.hear(safety_report("AGI", *holds, origin=self._origin()), FIWARE.id)


async def restarted() -> Desk:
    """An iVeg that has just started, without direct reading."""
    desk = Desk(("AGI",), direct=False)
    await desk.wait(0.5)
    return desk


def state(desk: Desk) -> str:
    return desk.commander.machine("AGI").state


async def test_a_hold_that_iveg_forgot_is_adopted_from_the_first_young_report() -> None:
    desk = await restarted()
    unproven = Robot(desk, heard=FeedbackRef("iveg-before", 90))
    unproven.report(BEFORE)
    waited = state(desk)

    unproven.heard = None
    unproven.report(BEFORE)
    await desk.wait(0.1)

    assert (waited, state(desk)) == ("RUNNING", "DELIVERED")
    assert desk.commander.machine("AGI").hold_id == BEFORE.id


async def test_a_hold_is_not_adopted_from_a_report_that_is_proven_to_be_old() -> None:
    desk = await restarted()
    told = desk.fleet.told[-1].origin
    heard = FeedbackRef(told.boot or "", told.seq or 0)
    await desk.wait(2.0)

    Robot(desk, heard=heard).report(BEFORE)

    assert state(desk) == "RUNNING"


@pytest.mark.parametrize(
    ("lags", "then"), [((0.2,), "DELIVERED"), ((30.0,), "RUNNING"), ((), "RUNNING")]
)
async def test_of_a_robot_that_does_not_echo_the_estimate_must_be_young(
    lags: tuple[float, ...], then: str
) -> None:
    desk = await restarted()
    for lag_s in lags:
        desk.lag(lag_s)
        desk.hear(HeartbeatProbe(Origin("iveg", 1)), FIWARE.id)

    Robot(desk, echoes=False).report(BEFORE)

    assert state(desk) == then
