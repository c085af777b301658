"""A STOP through a network that is late (F11) or loses a third of everything (F12).

On the virtual clock, against the robot's real safety machine.  Its brakes may take
their time and let go again for a moment, so that a standstill which was not measured
would be told.  ``IVEG_STOP_RUNS=1000`` runs as many as the fault matrix asks for.
"""

import os
from collections.abc import Iterable
from random import Random

import pytest

from iveg.domain.limits import LIMITS
from tests.properties.test_stop import (
    SORTS,
    TICK_S,
    Channel,
    StopOverBadTransports,
)

RUNS = int(os.environ.get("IVEG_STOP_RUNS", "200"))
BATCHES = 20
STANDING_WITHIN_S = 10.0
pytestmark = [pytest.mark.slow, pytest.mark.timeout(max(120, RUNS))]


class Late(Channel):
    """A transport on which a message takes 500 ± 200 ms and none overtakes another."""

    def __init__(self, rig: "Watched", rnd: Random) -> None:
        super().__init__()
        self._rig, self._rnd = rig, rnd
        self._due: list[tuple[float, object]] = []

    def put(self, message: object) -> None:
        last = self._due[-1][0] if self._due else 0.0
        late = self._rig.now + self._rnd.uniform(0.3, 0.7)
        self._due.append((max(last, late), message))

    def arrived(self) -> Iterable[object]:
        gone = [message for due, message in self._due if due <= self._rig.now]
        del self._due[: len(gone)]
        return gone


class Lossy(Channel):
    """A transport that loses 30 % of what it is given, and now and then everything."""

    def __init__(self, rig: "Watched", rnd: Random) -> None:
        super().__init__()
        self._rig, self._rnd = rig, rnd
        self._away_until = 0.0

    def put(self, message: object) -> None:
        now = self._rig.now
        if self._rnd.random() < 0.01:
            # The peer resets the connection: what was under way is gone with it.
            self._away_until = now + self._rnd.uniform(0.2, 1.5)
            self.waiting.clear()
        if now >= self._away_until and self._rnd.random() >= 0.3:
            super().put(message)


class Watched(StopOverBadTransports):
    """The rig with one who looks at the wheels, and brakes that are not obedient."""

    def __init__(self, rnd: Random) -> None:
        self.rested_since = float("inf")
        self.stood: list[tuple[float, float]] = []
        self.lets_go: list[tuple[float, float]] = []
        super().__init__()
        self.begin()
        self.run_for(rnd.uniform(0.5, 1.5))

    def press_with_brakes_of(self, rnd: Random) -> None:
        """The brakes bite late, and let go once more for a moment after a rest."""
        bites = rnd.choice((0.0, 0.0, 0.5, 2.0))
        again = bites + rnd.uniform(0.9, 1.8)
        self.lets_go = [
            (self.now, self.now + bites),
            (self.now + again, self.now + again + rnd.choice((0.0, 0.2, 0.5))),
        ]
        self.pressed_at = self.now
        self.somebody_presses("ana")

    def _drive(self) -> None:
        if any(since <= self.now < until for since, until in self.lets_go):
            self.rig.target = 0.8
        elif not self.rig.machine.may_drive:
            self.rig.target = 0.0
        super()._drive()
        rests = self.rig.speed < 0.02
        self.rested_since = min(self.rested_since, self.now) if rests else float("inf")

    def tick(self) -> None:
        before = self.iveg.state
        super().tick()
        if before != "STANDING" == self.iveg.state:
            self.stood.append((self.now, self.now - self.rested_since))

    def until_it_stands(self, limit_s: float) -> float:
        """Seconds from the press."""
        while self.iveg.state != "STANDING" and self.now < self.pressed_at + limit_s:
            self.run_for(TICK_S)
        return self.now - self.pressed_at


def through(transport: type[Late] | type[Lossy], rnd: Random) -> Watched:
    """A robot that drives, behind transports of this sort in both directions."""
    rig = Watched(rnd)
    for name in SORTS:
        rig.transports[name] = transport(rig, rnd)
    rig.run_for(1.0)
    return rig


@pytest.mark.parametrize("batch", range(BATCHES))
def test_f11_half_a_second_of_latency_makes_no_false_standstill(batch: int) -> None:
    false = []
    for number in range(RUNS // BATCHES):
        rnd = Random(batch * 1000 + number)  # noqa: S311 - repeatable on purpose
        rig = through(Late, rnd)
        rig.press_with_brakes_of(rnd)
        took = rig.until_it_stands(STANDING_WITHIN_S)
        assert took < STANDING_WITHIN_S, f"run {number}: {rig.iveg.state}"
        false += [
            number for _, rested in rig.stood if rested < LIMITS.standing_for_s - TICK_S
        ]

    assert false == []


@pytest.mark.parametrize("batch", range(BATCHES))
def test_f12_a_third_of_everything_lost_still_stands_in_ten_seconds(batch: int) -> None:
    took, tries = [], []
    for number in range(RUNS // BATCHES):
        rnd = Random(batch * 1000 + number)  # noqa: S311 - repeatable on purpose
        rig = through(Lossy, rnd)
        rig.press_with_brakes_of(rnd)
        took.append(rig.until_it_stands(30.0))
        assert rig.iveg.stop is not None
        tries.append(rig.iveg.stop.tries)
        # A move between two samples may be lost with them; one that goes on may not.
        assert all(rested >= LIMITS.standing_gap_s - TICK_S for _, rested in rig.stood)

    assert max(took) <= STANDING_WITHIN_S
    assert min(tries) >= 1
    assert max(tries) > 1, "nothing was ever lost"
