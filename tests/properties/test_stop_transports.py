"""RELEASE and STOP on two transports up to a minute late, on the virtual clock.

The rig of ``test_stop_kills`` with its witness: orders take each transport at their own
time, are lost, copied and overtaken; both sides restart; a person releases, resumes and
stops in between.  Nothing goes and nothing moves that a person did not let go, and the
holds do not pile up.
"""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from random import Random

import pytest

from iveg.domain.limits import LIMITS
from iveg.domain.observations import CommandAnswer
from iveg.domain.stop import Changed, Effect, SendStop
from iveg.domain.transports import FIWARE
from tests.properties.test_stop import DOWN, SORTS, TICK_S, Channel
from tests.properties.test_stop_kills import Watched

LIVES = int(os.environ.get("IVEG_STOP_LIVES", "100"))
BATCHES = 10
ACTS = 12
pytestmark = [pytest.mark.slow, pytest.mark.timeout(max(120, LIVES))]


@dataclass(frozen=True)
class Sky:
    """How a transport treats a message: at most so late (s), lost, doubled (0 to 1)."""

    late_s: float = 0.0
    lost: float = 0.0
    doubled: float = 0.0


PROMPT = Sky()
SKIES = (
    PROMPT,
    Sky(0.3),
    Sky(3.0, lost=0.2, doubled=0.3),
    Sky(60.0, doubled=0.3),
    Sky(60.0, lost=0.5),
    Sky(lost=1.0),
)
CONNECTIONS = (PROMPT, Sky(lost=0.5), Sky(lost=1.0))
"""A connection straight to the robot keeps the order of what it does not lose."""


class Transport(Channel):
    """Every message takes its own time, so that one may overtake another."""

    def __init__(self, rig: "Late", rnd: Random) -> None:
        super().__init__()
        self.sky = PROMPT
        self._rig, self._rnd = rig, rnd
        self._due: list[tuple[float, object]] = []

    def put(self, message: object) -> None:
        if self._rnd.random() < self.sky.lost:
            return
        for _ in range(1 + (self._rnd.random() < self.sky.doubled)):
            due = self._rig.now + self._rnd.uniform(0.0, self.sky.late_s)
            self._due.append((due, message))

    def forget(self) -> None:
        """What is under way never arrives."""
        self._due.clear()

    def arrived(self) -> Iterable[object]:
        now = self._rig.now
        self._due.sort(key=lambda one: one[0])
        gone = [message for due, message in self._due if due <= now]
        self._due = [one for one in self._due if one[0] > now]
        return gone


class Late(Watched):
    """The rig behind such transports; ``most`` is the largest pile that ever was."""

    def __init__(self, rnd: Random) -> None:
        self.most = 0
        self.rnd = rnd
        self.forgotten: set[str] = set()
        self.keys: list[str] = []
        super().__init__()
        self.ways = {name: Transport(self, rnd) for name in SORTS}
        self.transports.update(self.ways)
        self.run_for(1.0)

    def clear(self, *names: str) -> None:
        """From now on these are prompt; what is under way stays late."""
        for name in names:
            self.ways[name].sky = PROMPT

    def perform(self, effects: list[Effect]) -> None:
        for effect in effects:
            if isinstance(effect, Changed):
                self.keys.append(effect.key)
            if isinstance(effect, SendStop):
                known = self.reported_released - self.forgotten
                assert effect.hold_id not in known, "it was released, iVeg knows that"
        super().perform(effects)

    def iveg_restarts(self) -> None:
        # A new iVeg knows of old releases what the journal says, which is the names.
        self.forgotten = set(self.reported_released)
        self.ended.clear()
        named = self.disk.open_release
        super().iveg_restarts()
        again = self.iveg.hold_id
        assert again not in self.named or len(named) >= LIMITS.most_holds

    def the_robot_reboots(self) -> None:
        super().the_robot_reboots()
        self.rig.target = 0.0  # A drive without power does not begin to turn.

    def tick(self) -> None:
        super().tick()
        ours = [h for h in self.rig.machine.holds.holds if h.source == "iveg"]
        self.most = max(self.most, len(ours))

    def until(self, *states: str, limit_s: float) -> bool:
        end = self.now + limit_s
        while self.iveg.state not in states and self.now < end:
            self.run_for(TICK_S)
        return self.iveg.state in states


def act(rig: Late) -> None:
    """One thing that a person, the power or the weather does."""
    rnd = rig.rnd
    for name in DOWN:
        rig.ways[name].sky = rnd.choice(SKIES)
    match rnd.choice(("let_go",) * 5 + ("press", "iveg", "robot", "clear")):
        case "let_go":
            rig.let_go()
        case "press":
            rig.somebody_presses("ben")
        case "iveg":
            rig.iveg_restarts()
        case "robot":
            # Reports of the last boot die with it: which of two boots is the newer is
            # a question of its own (``domain/stream_order``).
            rig.ways["from_fiware"].forget()
            rig.the_robot_reboots()
        case _:
            rig.clear("direct")
    rig.run_for(rnd.choice((0.1, 0.5, 1.5, 2.3)))
    if rnd.random() < 0.6:
        rig.clear("direct")
        rig.until("STANDING", "READY", "RUNNING", limit_s=8.0)


@pytest.mark.parametrize("batch", range(BATCHES))
def test_two_late_transports_lose_no_hold_and_pile_up_none(batch: int) -> None:
    told: set[str] = set()
    released = 0
    for number in range(LIVES // BATCHES):
        rig = Late(Random(batch * 1000 + number))  # noqa: S311 - repeatable on purpose
        rig.ways["from_fiware"].sky = rig.rnd.choice(SKIES)
        rig.somebody_presses("ana")
        assert rig.until("STANDING", limit_s=8.0)
        for _ in range(ACTS):
            act(rig)
        told |= set(rig.keys)
        released += rig.asked

        assert rig.most <= LIMITS.most_holds, f"life {number}: {rig.most} holds"

    assert {"release_unconfirmed", "reasserted", "ready", "running"} <= told
    assert released


@pytest.mark.parametrize("batch", range(BATCHES))
def test_reports_that_are_late_as_well_free_and_move_nothing(batch: int) -> None:
    asked = 0
    for number in range(LIVES // BATCHES):
        rig = Late(Random(5000 + batch * 1000 + number))  # noqa: S311 - repeatable
        rig.somebody_presses("ana")
        assert rig.until("STANDING", limit_s=8.0)
        for _ in range(ACTS):
            rig.ways["from_direct"].sky = rig.rnd.choice(CONNECTIONS)
            rig.ways["from_fiware"].sky = rig.rnd.choice(SKIES)
            act(rig)
            rig.clear(*SORTS)
        asked += rig.asked

        # What is still under way may arrive: it is a minute old, and changes nothing.
        rig.somebody_presses("ben")
        rig.run_for(6.0)
        assert rig.until("STANDING", limit_s=10.0)

    assert asked


@pytest.mark.parametrize("seed", range(20))
def test_twenty_of_twenty_are_released_in_five_seconds_behind_an_agent_60_s_late(
    seed: int,
) -> None:
    rig = Late(Random(seed))  # noqa: S311 - repeatable on purpose
    for name in ("fiware", "from_fiware"):
        rig.ways[name].sky = Sky(60.0, doubled=0.2)
    rig.somebody_presses("ana")
    assert rig.until("STANDING", limit_s=8.0)
    began = rig.now

    while rig.iveg.state != "RUNNING" and rig.now < began + 5.0:
        rig.let_go()
        rig.run_for(TICK_S)

    assert rig.iveg.state == "RUNNING"
    # The copies through the agent come when it drives, and are known for copies.
    rig.run_for(61.0)
    assert rig.iveg.state == "RUNNING"
    assert "release_unconfirmed" not in rig.keys


@pytest.mark.parametrize("seed", range(10))
def test_the_late_refusal_of_one_attempt_changes_nothing_of_the_next(seed: int) -> None:
    rnd = Random(seed)  # noqa: S311 - repeatable on purpose
    rig = Late(rnd)
    rig.somebody_presses("ana")
    assert rig.until("STANDING", limit_s=8.0)
    early = refusals(rig)
    rig.somebody_releases()
    first = rig.iveg.order
    rig.rig.machine.local_hold("hw", rig.now)  # its challenge changes on the way
    rig.run_for(rnd.choice((0.1, 0.2)))
    assert first is not None
    assert rig.history[first.command_id].reason == "challenge"
    rig.the_crew_frees_the_robot()
    rig.run_for(rnd.choice((0.1, 0.5)))

    rig.somebody_releases()
    second = rig.iveg.order
    for refusal in early:
        rig.hear(refusal, FIWARE.id)
    assert rig.iveg.order == second is not None
    rig.run_for(1.0)

    assert early
    assert rig.iveg.state == "READY"


def refusals(rig: Late) -> list[CommandAnswer]:
    """From now on every refusal is written down here as well."""
    kept: list[CommandAnswer] = []
    put = rig.ways["from_fiware"].put

    def keep(message: object) -> None:
        if isinstance(message, CommandAnswer) and message.result == "REFUSED":
            kept.append(message)
        put(message)

    rig.ways["from_fiware"].put = keep  # type: ignore[method-assign]
    return kept
