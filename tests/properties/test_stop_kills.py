"""Kills in every phase of a STOP, on the virtual clock: 0 motions without a release.

The rig of ``test_stop`` with a seed in place of Hypothesis: a person works the robot,
and iVeg, the robot or all transports die at a moment that nobody chose (fault F13),
reboot (F15), or bring back what was said an hour ago (F36).
"""

from dataclasses import dataclass, field
from random import Random

import pytest

from iveg.domain.geometry import Twist2D
from iveg.domain.observations import CommandAnswer, SafetyReport
from iveg.robot import safety as robot
from tests.properties.test_stop import (
    SORTS,
    TICK_S,
    UP,
    Channel,
    StopOverBadTransports,
    Weather,
)

pytestmark = pytest.mark.slow
KILLS, LIVES = 500, 10
INTERLEAVINGS = 1000
WEATHERS: tuple[Weather, ...] = ("open", "open", "slow")
PHASES = ("RUNNING", "SENT", "DELIVERED", "STANDING", "RELEASING", "READY")


@dataclass
class Licence:
    """What people have allowed the robot, as a witness beside it sees."""

    lifted: set[str] = field(default_factory=set)
    resumed: bool = True
    known: set[str] = field(default_factory=set)


class Watched(StopOverBadTransports):
    """The rig with a witness: a hold goes and a motion comes by people alone."""

    def __init__(self) -> None:
        self.licence = Licence()
        self.motions = 0
        super().__init__()
        self.begin()

    def carry(self, effects: tuple[robot.Effect, ...]) -> None:
        super().carry(effects)
        held = {h.id for h in self.rig.machine.holds.holds if h.ack != "auto"}
        if held - self.licence.known:
            self.licence.resumed = False
        gone = self.licence.known - held
        assert gone <= self.licence.lifted, f"{gone} went, and nobody released it"
        self.licence.known = held

    def let_go(self) -> None:
        """Release if that is allowed now, else resume if that is."""
        before = self.asked
        holds = {hold.id for hold in self.iveg.evidence.holds}
        self.somebody_releases()
        if self.asked > before:
            self.licence.lifted |= holds
            return
        self.somebody_resumes()
        if self.asked > before:
            self.licence.resumed = True

    def tick(self) -> None:
        before = self.rig.speed
        super().tick()
        starts = before < 0.02 <= self.rig.speed
        assert not starts or self.licence.resumed, "it moves, and nobody resumed it"
        self.motions += starts

    def the_crew_frees_the_robot(self) -> None:
        held = {hold.id for hold in self.rig.machine.holds.holds}
        self.licence.lifted |= held
        super().the_crew_frees_the_robot()
        self.licence.resumed = True

    def the_robot_reboots(self) -> None:
        super().the_robot_reboots()
        # The hold of a new boot takes the place of what the last boot made itself.
        now = {hold.id for hold in self.rig.machine.holds.holds}
        assert any(one.startswith("boot-") for one in now), "R4"
        self.licence.known = {
            one for one in self.licence.known if not one.startswith(("boot-", "link-"))
        }
        self.licence.resumed = False

    def begin(self) -> None:
        self.rig.boot(self.now)
        self.the_crew_frees_the_robot()
        self.run_for(3.0)

    def mend(self) -> None:
        for transport in self.transports.values():
            transport.weather = "open"


def bring_to(rig: Watched, phase: str, limit_s: float = 25.0) -> bool:
    """Work the robot until iVeg is in this phase; whether it came to be."""
    rig.mend()
    rig.transports["direct"].weather = "slow" if phase == "SENT" else "open"
    end = rig.now + limit_s
    while rig.iveg.state != phase and rig.now < end:
        sooner = phase in ("SENT", "DELIVERED") and rig.iveg.state == "STANDING"
        if sooner or phase in ("RUNNING", "READY", "RELEASING"):
            rig.let_go()
        elif not rig.iveg.wants_stop:
            rig.somebody_presses("ana")
        if rig.iveg.state != phase:
            rig.run_for(TICK_S)
    return rig.iveg.state == phase


def kill(rig: Watched, rnd: Random) -> str:
    """One process dies, for a while or for a moment."""
    victim = rnd.choice(("iveg", "robot", "transports", "both"))
    away = rnd.choice((0.0, 0.3, 2.0, 4.0))
    if victim in ("iveg", "both"):
        rig.iveg_restarts()
    if victim in ("robot", "both"):
        rig.the_robot_reboots()
    if victim == "transports":
        for name in SORTS:
            rig.transports[name].weather = "cut"
            rig.transports[name].waiting.clear()
    rig.run_for(away)
    rig.mend()
    return victim


@pytest.mark.parametrize("seed", range(LIVES))
def test_f13_f15_fifty_kills_of_one_life_move_nothing_that_nobody_released(
    seed: int,
) -> None:
    rnd = Random(seed)  # noqa: S311 - repeatable on purpose
    rig = Watched()
    reached: set[str] = set()
    for number in range(KILLS // LIVES):
        phase = PHASES[number % len(PHASES)]
        reached |= {phase} if bring_to(rig, phase) else set()
        rig.run_for(rnd.choice((0.0, 0.05, 0.1, 0.7)))
        wanted = rig.iveg.wants_stop and rig.iveg.state != "RELEASING"
        victim = kill(rig, rnd)
        rig.run_for(rnd.choice((0.0, 1.0, 3.0)))
        assert not wanted or rig.iveg.wants_stop, f"seed {seed}: {victim} in {phase}"

    rig.l1_when_messages_get_through_a_stopped_robot_is_seen_to_stand()
    assert rig.motions > 0, "nothing ever moved, so nothing was proved"
    assert reached == set(PHASES)


@pytest.mark.parametrize("seed", range(10))
def test_f36_a_release_and_a_resume_of_an_hour_ago_are_ignored(seed: int) -> None:
    rnd = Random(seed)  # noqa: S311 - repeatable on purpose
    rig = Watched()
    old: list[object] = []
    assert bring_to(rig, "STANDING")
    for _ in range(2):
        rig.let_go()
        old += rig.transports["fiware"].waiting
        rig.run_for(rnd.choice((0.5, 1.0)))
    assert len(old) >= 2
    assert bring_to(rig, "STANDING")
    rig.now += 3600.0
    rig.run_for(2.0)

    for message in rnd.sample(old, len(old)):
        rig.transports["fiware"].put(message)
        rig.run_for(0.5)

    # The witness in the rig has seen every hold and every motion meanwhile.
    assert rig.iveg.hold_id in {hold.id for hold in rig.rig.machine.holds.holds}
    assert rig.rig.speed < 0.02


@pytest.mark.parametrize("seed", range(INTERLEAVINGS // 100))
def test_f37_whoever_stops_while_another_releases_wins_every_time(seed: int) -> None:
    rnd = Random(seed)  # noqa: S311 - repeatable on purpose
    rig = Watched()
    assert bring_to(rig, "STANDING")

    won = sum(interleave(rig, rnd) for _ in range(100))

    assert won == 100
    assert rig.asked > 0, "no release was ever asked, so nothing was proved"


def interleave(rig: Watched, rnd: Random) -> bool:
    """A releases and resumes, B stops somewhere in between; whether B has won."""
    for name in SORTS:
        rig.transports[name].weather = rnd.choice(WEATHERS)
    acts = ["let_go", "let_go", "let_go", "stop"]
    rnd.shuffle(acts)
    for act in acts:
        if act == "stop":
            rig.somebody_presses("ben")
        else:
            rig.let_go()
        rig.run_for(rnd.choice((0.0, 0.05, 0.1, 0.3)))
    rig.mend()
    rig.run_for(3.5)
    return rig.iveg.state == "STANDING" and rig.rig.speed < 0.02


def test_f39_without_answers_reports_bring_standing_in_two_and_a_half_seconds() -> None:
    rig = crawling()
    lose(rig, CommandAnswer)

    rig.somebody_presses("ana")
    rig.run_for(2.5)

    assert rig.iveg.state == "STANDING"


def test_f39_without_reports_answers_bring_delivered_and_never_standing() -> None:
    rig = crawling()
    lose(rig, SafetyReport)

    rig.somebody_presses("ana")
    rig.run_for(0.25)
    soon = rig.iveg.state
    rig.run_for(10.0)

    assert (soon, rig.iveg.state) == ("DELIVERED", "STILL_MOVING")


def crawling() -> Watched:
    """A robot at 0.3 m/s, which brakes in well under a second."""
    rig = Watched()
    rig.rig.wished = Twist2D(0.3, 0.0)
    rig.run_for(2.0)
    return rig


class Losing(Channel):
    """A transport on which one kind of word is always lost."""

    def __init__(self, kind: type) -> None:
        super().__init__()
        self._kind = kind

    def put(self, message: object) -> None:
        if not isinstance(message, self._kind):
            super().put(message)


def lose(rig: Watched, kind: type) -> None:
    for name in UP:
        rig.transports[name] = Losing(kind)
