"""Reports of an earlier boot, or of unknown age, that FIWARE brings late: none acts."""

from collections import Counter
from dataclasses import replace

import pytest

from iveg.domain.observations import FeedbackRef, HeartbeatProbe, Hold, Origin
from iveg.domain.transports import FIWARE
from tests.builders import odometry, origin, safety_report
from tests.unit.vital.desk import Desk, conditions_of

BEFORE = Hold("01BEFORE", "iveg", "remote")
EARLIER_IVEG = FeedbackRef("iveg-before", 90)


class Robot:
    """AGI, which FIWARE alone connects, as it was in one boot.

    Attributes:
        heard: What it echoes, where it is not iVeg's newest feedback.
        echoes: Whether it tells what it heard at all.
    """

    def __init__(
        self,
        desk: Desk,
        boot: str,
        *,
        heard: FeedbackRef | None = None,
        echoes: bool = True,
    ) -> None:
        self.desk, self.boot, self.heard, self.echoes = desk, boot, heard, echoes
        self._seqs: Counter[str] = Counter()
        self._booted = desk.clock.now

    def _origin(self, topic: str, age_s: float) -> Origin:
        self._seqs[topic] += 1
        now = self.desk.clock.now
        said = origin(self._seqs[topic], boot=self.boot, after=now - age_s)
        if not self.echoes:
            return said
        told = self.desk.fleet.told[-1].origin
        heard = self.heard or FeedbackRef(told.boot or "", told.seq or 0)
        mono = 500.0 + now - self._booted
        return replace(said, mono=mono, acknowledgements=True, heard=heard)

    def report(
        self,
        *holds: Hold,
        linear: float = 0.0,
        age_s: float = 0.1,
        released: tuple[str, ...] = (),
    ) -> None:
        said = self._origin("safety", age_s)
        report = safety_report(
            "AGI", *holds, linear=linear, released=released, origin=said
        )
        self.desk.hear(report, FIWARE.id)

    def drive(self, linear: float) -> None:
        said = self._origin("odometry", 0.1)
        self.desk.hear(odometry(linear=linear, origin=said), FIWARE.id)

    async def hold(self, seconds: float) -> None:
        """It stands, held as iVeg wants."""
        for _ in range(round(seconds / 0.1)):
            self.report(Hold(hold_id(self.desk), "iveg", "remote"))
            await self.desk.wait(0.1)


async def restarted() -> Desk:
    """An iVeg that has just started, without direct reading."""
    desk = Desk(("AGI",), direct=False)
    await desk.wait(0.5)
    return desk


def hold_id(desk: Desk) -> str:
    return desk.commander.machine("AGI").hold_id or ""


def state(desk: Desk) -> str:
    return desk.commander.machine("AGI").state


def stop_alerts(desk: Desk) -> list[str]:
    return [key for key in conditions_of(desk) if key.startswith("alert.stop")]


def stops(desk: Desk) -> list[str]:
    """What was ordered or told of STOP."""
    asked = [what for what, *_ in desk.broker.asked]
    return asked + [key for key in desk.sentences() if key.startswith("log.stop")]


async def test_a_hold_that_iveg_forgot_is_adopted_from_the_first_young_report() -> None:
    desk = await restarted()
    unproven = Robot(desk, "boot-a", heard=EARLIER_IVEG)
    unproven.report(BEFORE)
    waited = state(desk)

    unproven.heard = None
    unproven.report(BEFORE)
    await desk.wait(0.1)

    assert (waited, state(desk)) == ("RUNNING", "DELIVERED")
    assert hold_id(desk) == BEFORE.id


async def test_a_hold_is_not_adopted_from_a_report_that_is_proven_to_be_old() -> None:
    desk = await restarted()
    told = desk.fleet.told[-1].origin
    heard = FeedbackRef(told.boot or "", told.seq or 0)
    await desk.wait(2.0)

    Robot(desk, "boot-a", heard=heard).report(BEFORE)

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

    Robot(desk, "boot-a", echoes=False).report(BEFORE)

    assert state(desk) == then
