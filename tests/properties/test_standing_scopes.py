"""A standstill is measured with each scope of ``IVEG_DIRECT_READ``, over a late chain.

A real safety machine reports; what of it reaches a real STOP machine, and when, is what
the scope and the chain let through.
"""

from random import Random

import pytest

from iveg.domain.observations import SafetyReport
from iveg.domain.stop import SendStop, StopMachine
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from iveg.ngsi import codec
from iveg.robot.safety import Effect, Report
from tests.builders import at
from tests.unit.robot.rig import STEP_S, Rig

JITTER_S: dict[TransportId, float] = {DIRECT.id: 0.06, FIWARE.id: 0.25}
BASE_S: dict[TransportId, float] = {DIRECT.id: 0.005, FIWARE.id: 0.02}


class Greenhouse:
    """One robot that drives, one iVeg, and what is on the way between them."""

    def __init__(self, scope: str, seed: int) -> None:
        self.transports: tuple[TransportId, ...] = (
            (FIWARE.id,) if scope == "off" else (DIRECT.id, FIWARE.id)
        )
        self.chance = Random(seed)  # noqa: S311 - a delay, no secret
        self.iveg = StopMachine("AGI")
        self.rig = Rig().drive_on()
        self.seen = len(self.rig.log)
        self.count = 0
        self.known = -1
        self.on_the_way: list[tuple[float, int, SafetyReport, TransportId]] = []
        self.ids = iter(f"01ID{number:06d}" for number in range(1000))

    def press(self) -> None:
        for effect in self.iveg.press("ana", at(self.rig.now), next(self.ids)):
            if isinstance(effect, SendStop) and effect.transport == "direct":
                order = codec.StopOrder(effect.hold_id, "ana")
                self.rig.command(codec.write_command(order))

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            self.rig.step()
            for when, effect in self.rig.log[self.seen :]:
                self._leave(when, effect)
            self.seen = len(self.rig.log)
            self._arrive()
            self.iveg.tick(at(self.rig.now), next(self.ids))

    def _leave(self, when: float, effect: Effect) -> None:
        if not isinstance(effect, Report):
            return
        self.count += 1
        for transport in self.transports:
            if transport == "direct" or effect.is_measure:
                late = BASE_S[transport] + self.chance.uniform(0.0, JITTER_S[transport])
                self.on_the_way.append(
                    (when + late, self.count, effect.report, transport)
                )

    def _arrive(self) -> None:
        self.on_the_way.sort(key=lambda one: one[:2])
        while self.on_the_way and self.on_the_way[0][0] <= self.rig.now:
            when, count, report, transport = self.on_the_way.pop(0)
            if count > self.known:
                self.known = count
                sparse = transport == "fiware"
                self.iveg.reported(
                    report, at(when), transport, next(self.ids), sparse=sparse
                )


@pytest.mark.parametrize("scope", ["all", "safety", "off"])
@pytest.mark.parametrize("seed", range(20))
def test_a_stopped_robot_stands_within_five_seconds(scope: str, seed: int) -> None:
    place = Greenhouse(scope, seed)
    place.press()

    place.run(5.0)
    assert place.iveg.state == "STANDING"

    place.run(10.0)
    assert place.iveg.state == "STANDING"
    assert place.iveg.stop is not None
    assert place.iveg.stop.reason is None


@pytest.mark.parametrize("scope", ["all", "off"])
def test_a_robot_that_falls_silent_stands_no_more(scope: str) -> None:
    place = Greenhouse(scope, 1)
    place.press()
    place.run(5.0)
    place.transports = ()

    place.run(2.2)

    assert place.iveg.state == "STALE"
