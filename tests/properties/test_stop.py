"""The STOP machine against a real safety machine over channels that lose and mix.

A person presses, releases and resumes; robot and iVeg restart; each of the four
channels is open, slow or cut, and copies and mixes what waits on it.  The invariants
bear the names of docs/safety.md.
"""

import itertools
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from math import inf
from random import Random
from typing import Literal

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from iveg.domain.errors import CommandRefusedError
from iveg.domain.feedback import Feedback
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import (
    CommandAnswer,
    Instant,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.domain.stop import (
    Changed,
    Closed,
    DesiredRecord,
    Effect,
    FollowedCommand,
    OffTable,
    SendOnce,
    SendStop,
    SetDesiredState,
    StopMachine,
)
from iveg.domain.stream_order import StreamOrder
from iveg.domain.transports import TransportId
from iveg.ngsi import codec
from iveg.robot import safety as robot
from iveg.robot.holds import HoldSet
from iveg.robot.safety import SafetyMachine
from tests.builders import START

TICK_S = 0.05
HERE = Pose2D(0.0, 0.0, 0.0)
REST = Twist2D(0.0, 0.0)

Weather = Literal["open", "slow", "cut"]
DOWN: tuple[str, ...] = ("direct", "fiware")
UP: tuple[str, ...] = ("from_direct", "from_fiware")
SORTS = DOWN + UP
sorts = st.sampled_from(SORTS)


@dataclass
class Channel:
    """One transport in one direction: what waits on it, and the weather."""

    weather: Weather = "open"
    waiting: list[object] = field(default_factory=list)

    def put(self, message: object) -> None:
        self.waiting += [message] * (self.weather != "cut")

    def arrived(self) -> Iterable[object]:
        gone = self.waiting * (self.weather == "open")
        self.waiting = self.waiting * (self.weather == "slow")
        return gone


class RobotRig:
    """A real safety machine, a drive that brakes, and its disk."""

    def __init__(self) -> None:
        self.disk = HoldSet()
        self.boots, self.names, self.seq = (itertools.count(1) for _ in range(3))
        self.wished = Twist2D(0.8, 0.0)
        self.speed = self.target = 0.0
        self.feedback_seq = 0
        self.rates: dict[str | None, float] = {}

    def boot(self, now: float, rate: float = 1.0) -> None:
        self.name = f"b{next(self.boots)}"
        self.booted, self.rates[self.name] = now, rate
        self.odometry_seq = itertools.count(1)
        self.machine = SafetyMachine(
            "AGI",
            self.name,
            now,
            stored=self.disk,
            fresh=lambda: f"n{next(self.names)}",
        )

    def stamp(self, now: float, seq: Iterator[int]) -> Origin:
        number = next(seq)
        lived_s = now - self.booted + 1e-6 * number  # It rises within a tick, too.
        return Origin(self.name, number, mono=self.rates[self.name] * lived_s)


class StopOverBadTransports(RuleBasedStateMachine):
    """Both machines, four transports, one person."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0
        self.transports = {name: Channel() for name in SORTS}
        self.rig = RobotRig()
        self.ids = itertools.count(1)
        self.level: tuple[str, ...] = ()
        self.journal = False
        self.disk = DesiredRecord("ana")
        self.named: set[str] = set()
        self.asking = False
        self.asked = self.sent_once = 0
        self.ended: set[str] = set()
        self.reported_released: set[str] = set()
        self.episode: str | None = None
        self.history: dict[str, FollowedCommand] = {}
        self.measured: dict[tuple[str | None, int | None], float] = {}
        self.restart()

    # --- both sides ---------------------------------------------------------------

    def at(self) -> Instant:
        return START.later(self.now)

    def new_id(self) -> str:
        return f"01ID{next(self.ids):06d}"

    def restart(self) -> None:
        """A new iVeg: nothing is known but the journal."""
        self.iveg = StopMachine("AGI")
        self.history.clear()
        self.order, self.asked, self.sent_once = StreamOrder(), 0, 0
        self.samples: list[tuple[float, SafetyReport, TransportId, float]] = []
        self.moved_at = self.last_send = self.heard_at = float("-inf")
        self.releasing_since: float | None = None
        self.episode = None

    def perform(self, effects: list[Effect]) -> None:
        for effect in effects:
            assert not isinstance(effect, OffTable), effect
            if isinstance(effect, SendStop):
                shown = {hold.id for hold in self.iveg.evidence.holds}
                assert effect.hold_id not in self.ended - shown, "an old id came again"
                assert effect.hold_id == self.iveg.hold_id
                self.last_send = max(self.last_send, self.now)
                payload = codec.write_command(codec.StopOrder(effect.hold_id, "x"))
                self.transports[effect.transport].put(payload)
                facts = effect.transport, effect.command_id, self.at()
                self.perform(self.iveg.sent(*facts, ok=True))
            elif isinstance(effect, SendOnce):
                self._send_once(effect)
            elif isinstance(effect, SetDesiredState):
                self.level = effect.ids
            elif isinstance(effect, Closed):
                self._keep(effect.command)
            elif isinstance(effect, Changed):
                self._keep(*effect.commands)
                self._changed(effect)
        self._keep(self.iveg.stop, self.iveg.order)

    def _keep(self, *commands: FollowedCommand | None) -> None:
        """The last that was told of each command."""
        self.history |= {one.command_id: one for one in commands if one is not None}

    def _send_once(self, effect: SendOnce) -> None:
        assert self.asking, "I2, I6: nobody asked for this"
        self.sent_once += 1
        attempt, command = effect.attempt, effect.attempt.command
        challenge, named = attempt.challenge, command.command_id
        order = codec.ResumeOrder(challenge, named)
        if command.kind == "release":
            order = codec.ReleaseOrder(challenge, named, tuple(attempt.ids))
            self.remember(effect)
        for transport in command.transports:
            self.transports[transport].put(codec.write_command(order))

    def remember(self, effect: SendOnce) -> None:
        """What the journal keeps of a release, before it goes."""
        self.named |= set(effect.ours)
        self.disk = replace(
            self.disk,
            named=(*self.disk.named, *effect.ours),
            open_release=effect.ours,
            challenge=effect.attempt.challenge,
        )

    def _changed(self, changed: Changed) -> None:
        self.releasing_since = self.now if changed.state == "RELEASING" else None
        if changed.state == "STANDING" and changed.key == "standing":
            self._i3_standing_is_measured()
        if changed.key == "adopted" or changed.state == "REQUESTED":
            self._new_episode()
        if changed.key in ("ready", "running"):
            self._i1_ended_by_the_robots_report()
            self.journal = False
            self.disk = replace(self.disk, open_release=(), challenge=None)

    def _new_episode(self) -> None:
        new = self.iveg.hold_id
        assert new is not None
        self.journal = True
        self.disk = replace(self.disk, hold_id=new)
        if new == self.episode:
            return
        assert new not in self.ended - {hold.id for hold in self.iveg.evidence.holds}
        if self.episode is not None:
            self.ended.add(self.episode)
        self.episode = new

    def _i1_ended_by_the_robots_report(self) -> None:
        if self.episode is not None:
            assert self.episode in self.reported_released, "I1"
            self.ended.add(self.episode)
            self.episode = None

    def _i3_standing_is_measured(self) -> None:
        run: list[float] = []
        longest = 0.0
        for when, report, transport, late_s in reversed(self.samples):
            held = {hold.id for hold in report.holds}
            # No echo proves a gap to be longer than that since the last arrival.
            is_gap = run and run[-1] - when > longest + late_s + 1e-9
            if self.iveg.hold_id not in held or not _rests(report) or is_gap:
                break
            run.append(when)
            # Orion brings two a second: one and a half of their period.
            longest = 0.5 if transport == "direct" else 0.75
        # By arrivals, the lateness of the newest counts as rest if the clock is wrong.
        gained_s = self.samples[-1][3] + 1e-9
        assert len(run) >= 5, "I3: five samples"
        assert run[0] - run[-1] >= 1.0 - gained_s, "I3: over a second"
        assert run[0] - self.moved_at >= 0.5 - gained_s, "I3: odometry agrees"
        assert self.now - run[0] <= 1.5 + 1e-9, "I3: it stands now, not once"

    def carry(self, effects: tuple[robot.Effect, ...]) -> None:
        """Do what the robot's machine wants; its words go out on both transports."""
        for effect in effects:
            if isinstance(effect, robot.Drive):
                self.rig.target = effect.twist.linear_x
            elif isinstance(effect, robot.Persist):
                self.rig.disk = effect.holds
            else:
                self._say(effect)

    def _say(self, effect: robot.SendAnswer | robot.Report) -> None:
        origin = self.rig.stamp(self.now, self.rig.seq)
        if isinstance(effect, robot.SendAnswer):
            payload = codec.write_answer(replace(effect.answer, origin=origin))
            reading = codec.read_answer("AGI", payload)
        else:
            payload = codec.write_measure(replace(effect.report, origin=origin))
            reading = codec.read_measure("AGI_safety", payload)
            self.rig.machine.reported(origin.seq or 0, self.now)
            self.measured[origin.boot, origin.seq] = self.now
        for transport in UP:
            if transport == "from_fiware" and not getattr(effect, "is_measure", True):
                continue  # ten a second are for iVeg alone
            for observation in reading.observations:
                self.transports[transport].put(observation)

    # --- time ---------------------------------------------------------------------

    def tick(self) -> None:
        self.now = round(self.now + TICK_S, 6)
        for down in DOWN:
            for payload in self.transports[down].arrived():
                assert isinstance(payload, bytes)
                self.carry(self.rig.machine.command(payload, self.now))
        self._drive()
        for up in UP:
            for word in self.transports[up].arrived():
                self.hear(word, TransportId(up.removeprefix("from_")))
        self.perform(self.iveg.tick(self.at(), self.new_id()))

    def _drive(self) -> None:
        rig = self.rig
        step = 1.0 * TICK_S
        rig.speed += max(-step, min(step, rig.target - rig.speed))
        twist = Twist2D(rig.speed, 0.0)
        self.carry(rig.machine.odometry(HERE, twist, self.now))
        if self.transports["from_direct"].weather == "open":
            rig.feedback_seq += 1
            origin = Origin("cloud", rig.feedback_seq)
            seen = {"AGI": self.order.seq} if self.order.boot == rig.name else {}
            feedback = Feedback("AGI", origin, seen=seen)
            self.carry(rig.machine.feedback("AGI", feedback, self.now))
            self._odometry(rig.speed)
        neutral = rig.machine.may_drive
        self.carry(rig.machine.request_twist(rig.wished if neutral else REST, self.now))

    def _odometry(self, speed: float) -> None:
        self.moved_at = self.now if speed >= 0.02 else self.moved_at
        origin = self.rig.stamp(self.now, self.rig.odometry_seq)
        said = Odometry("AGI", origin, HERE, Twist2D(speed, 0.0))
        self.perform(self.iveg.odometry(said, self.at(), self.new_id(), inf))

    def hear(self, word: object, transport: TransportId) -> None:
        if isinstance(word, CommandAnswer):
            self.perform(self.iveg.answered(word, self.at(), transport, self.new_id()))
        if not isinstance(word, SafetyReport):
            return
        if self.order.judge(word.origin, self.now) == "new":
            measured = self.measured[word.origin.boot, word.origin.seq]
            age_s, sparse = self.now - measured, transport == "fiware"
            is_wrong = self.rig.rates[word.origin.boot] != 1.0
            self.samples.append((measured, word, transport, age_s * is_wrong))
            self.heard_at = self.now
            self.reported_released |= set(word.released)
            effects = self.iveg.reported(
                word, self.at(), transport, self.new_id(), age_s, sparse=sparse
            )
            self.perform(effects)

    def run_for(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.tick()
            self.i4_a_stop_that_does_not_stand_is_sent_all_the_time()
            self.i7_a_release_is_confirmed_or_a_stop()

    # --- what happens -------------------------------------------------------------

    @initialize()
    def begin(self) -> None:
        self.rig.boot(self.now)
        self.carry(self.rig.machine.release_locally(self.now))
        self.run_for(3.0)

    @rule(seconds=st.sampled_from([0.05, 0.2, 0.6, 1.2, 2.5]))
    def time_passes(self, seconds: float) -> None:
        self.run_for(seconds)

    @rule(transport=sorts, weather=st.sampled_from(["open", "open", "slow", "cut"]))
    def the_weather_changes(self, transport: str, weather: Weather) -> None:
        self.transports[transport].weather = weather

    @rule(transport=sorts, rnd=st.randoms(use_true_random=False))
    def a_transport_mixes_copies_and_loses(self, transport: str, rnd: Random) -> None:
        waiting = self.transports[transport].waiting
        picked = [one for one in waiting for _ in range(rnd.randint(0, 2))]
        rnd.shuffle(picked)
        self.transports[transport].waiting = picked[:50]

    @rule(by=st.sampled_from(["ana", "ben"]))
    def somebody_presses(self, by: str) -> None:
        self.perform(self.iveg.press(by, self.at(), self.new_id()))
        assert self.iveg.wants_stop

    @rule()
    def somebody_releases(self) -> None:
        seen = [hold.id for hold in self.iveg.evidence.holds if hold.ack == "remote"]
        self._ask(lambda: self.iveg.release("ana", seen, self.at(), self.new_id()))

    @rule()
    def somebody_resumes(self) -> None:
        self._ask(lambda: self.iveg.resume("ana", self.at(), self.new_id()))

    @rule(
        fiware=st.sampled_from(["open", "slow", "cut"]),
        up=st.sampled_from(["open", "cut"]),
        wait=st.sampled_from([0.3, 2.8]),
    )
    def a_standing_robot_is_released_in_bad_weather(
        self, fiware: Weather, up: Weather, wait: float
    ) -> None:
        for transport in self.transports.values():
            transport.weather = "open"
        self.somebody_presses("ana")
        self.run_for(3.5)
        self.transports["fiware"].weather = fiware
        self.somebody_releases()
        for name in UP:
            self.transports[name].weather = up
        self.run_for(wait)

    def _ask(self, asking: Callable[[], list[Effect]]) -> None:
        self.asking = True
        stood = self.samples and _rests(self.samples[-1][1])
        fresh = (
            self.now - self.heard_at <= 1.0 and self.now - self.samples[-1][0] <= 1.5
        )
        try:
            effects = asking()
        except CommandRefusedError:
            effects = []
        else:
            assert stood, "I2: standing"
            assert fresh, "I2: fresh"
            self.asked += 1
        self.perform(effects)
        self.asking = False

    @rule(rate=st.sampled_from([1.0, 1.0, 0.0, 0.3, 3.0]))
    def the_robot_reboots(self, rate: float = 1.0) -> None:
        """Its clock may be wrong from then on."""
        self.rig.boot(self.now, rate)

    @rule()
    def the_crew_frees_the_robot(self) -> None:
        self.carry(self.rig.machine.release_locally(self.now))

    @rule()
    def the_red_button_is_pressed(self) -> None:
        self.carry(self.rig.machine.local_hold("hw", self.now))

    @rule(many=st.sampled_from([1, 60]))
    def strangers_stop_the_robot(self, many: int) -> None:
        for _ in range(many):
            payload = codec.write_command(codec.StopOrder(self.new_id(), "x"))
            self.carry(self.rig.machine.command(payload, self.now))

    @rule()
    def iveg_restarts(self) -> None:
        wanted, before = self.journal, self.episode
        self.restart()
        self.episode = before if wanted else None
        if wanted:
            again = self.iveg.restore(self.disk, self.at(), self.new_id())
            self.perform(again)

    @rule()
    def l1_when_messages_get_through_a_stopped_robot_is_seen_to_stand(self) -> None:
        for transport in self.transports.values():
            transport.weather = "open"
        self.run_for(2.0)
        ends = self.now + 10.0
        while not self._has_settled() and self.now < ends:
            self.run_for(0.5)
        self.run_for(1.0)
        assert self._has_settled(), "L1"

    def _has_settled(self) -> bool:
        held = self.rig.machine.holds.find(self.iveg.hold_id or "")
        stands = held is not None and self.rig.speed < 0.02
        settled = self.iveg.state in ("RUNNING", "READY", "STANDING")
        return settled and (stands or not self.iveg.wants_stop)

    # --- what is always true ------------------------------------------------------

    @invariant()
    def i1_an_accepted_stop_stays_wanted_until_its_release_was_reported(self) -> None:
        if self.episode is not None:
            assert self.iveg.wants_stop

    @invariant()
    def i4_a_stop_that_does_not_stand_is_sent_all_the_time(self) -> None:
        if self.iveg.wants_stop and self.iveg.state not in ("STANDING", "RELEASING"):
            assert self.now - self.last_send <= 1.1

    @invariant()
    def i6_there_is_one_message_for_each_thing_a_person_asked(self) -> None:
        assert self.sent_once == self.asked

    @invariant()
    def i7_a_release_is_confirmed_or_a_stop(self) -> None:
        if self.releasing_since is not None:
            assert self.now - self.releasing_since <= 2.5

    @invariant()
    def i9_no_row_of_the_past_says_that_it_still_goes_on(self) -> None:
        followed = {command.command_id for command in self.iveg.commands}
        for command_id in self.history.keys() - followed:
            command = self.history[command_id]
            is_over = command.state in ("RUNNING", "REPLACED")
            assert is_over or command.kind != "stop"
            assert command.state != "RELEASING"

    @invariant()
    def the_level_says_what_is_wanted(self) -> None:
        if self.iveg.wants_stop and self.iveg.state != "RELEASING":
            assert self.level == (self.iveg.hold_id,)


def _rests(report: SafetyReport) -> bool:
    return max(abs(report.linear), abs(report.angular)) < 0.02


EXAMPLES = int(os.environ.get("IVEG_STOP_EXAMPLES", "200"))
"""More by ``make deep``."""
# A busy machine may be slow without being wrong; a deep search takes hours.
pytestmark = pytest.mark.timeout(600 if EXAMPLES <= 200 else 100_000)

StopOverBadTransports.TestCase.settings = settings(
    max_examples=EXAMPLES, stateful_step_count=25
)
TestStopOverBadTransports = StopOverBadTransports.TestCase
