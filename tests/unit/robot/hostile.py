"""A robot among lossy, duplicating, reordering channels, junk and power cuts.

Events are plain values, so Hypothesis can make and shrink them; ``World`` plays them on
a safety machine and keeps every call as a ``Transition`` for the properties to judge.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Literal

from hypothesis import strategies as st

from iveg.domain.feedback import Feedback, SpeedLimit
from iveg.domain.geometry import Twist2D
from iveg.domain.observations import Hold
from iveg.robot.holds import HoldSet
from iveg.robot.safety import Drive, Effect, Persist, Report, SendAnswer
from tests.unit.robot.rig import AHEAD, REST, Rig, person, release, resume, stop

SLOWLY = Twist2D(0.1, 0.0)


@dataclass(frozen=True)
class Transition:
    """One call of the machine.

    Attributes:
        did: Name of the event behind it.
        payload: What came on ``cmd``, if it did.
        challenge: Valid just before.
        heard: Latest sending time of a report that any feedback so far has seen.
        at_rest_since: Since when upstream has wished for nothing; None: it wishes.
    """

    did: str
    at: float
    before: HoldSet
    after: HoldSet
    challenge: str
    state: str
    effects: tuple[Effect, ...]
    payload: bytes | None
    heard: float | None
    at_rest_since: float | None

    @property
    def twists(self) -> list[Twist2D]:
        return [one.twist for one in self.effects if isinstance(one, Drive)]

    @property
    def moves(self) -> bool:
        return any(twist != REST for twist in self.twists)

    @property
    def answers(self) -> list[str]:
        return [
            one.answer.result for one in self.effects if isinstance(one, SendAnswer)
        ]

    @property
    def lost(self) -> list[Hold]:
        """Holds that are no more, or that became weaker."""
        return [hold for hold in self.before.holds if hold not in self.after.holds]


@dataclass(frozen=True)
class Event:
    """``World.<name>`` is called with ``values``."""

    name: str
    values: tuple[object, ...] = ()


@dataclass
class World(Rig):
    """Plays events; lost messages are those that no event delivers."""

    transitions: list[Transition] = field(default_factory=list)
    boots: list[Transition] = field(default_factory=list)
    sent_at: dict[int, float] = field(default_factory=dict)
    commands: list[bytes] = field(default_factory=list)
    feedbacks: list[Feedback] = field(default_factory=list)
    challenges: list[str] = field(default_factory=list)
    heard: float | None = None
    rest_since: float | None = None
    wish_at: float = -1e9
    did: str = "boot"
    payload: bytes | None = None

    def play(self, events: list[Event]) -> "World":
        for event in events:
            self.did = event.name
            getattr(self, event.name)(*event.values)
        return self

    # --- bookkeeping ----------------------------------------------------------------

    def call(self, machine: Callable[[], tuple[Effect, ...]]) -> tuple[Effect, ...]:
        before, challenge = self.machine.holds, self.machine.challenge
        self.challenges = [*self.challenges, challenge][-20:]
        effects = machine()
        after, state = self.machine.holds, self.machine.state(self.now)
        told = self.payload, self.heard, self.rest_since
        self.transitions.append(
            Transition(
                self.did, self.now, before, after, challenge, state, effects, *told
            )
        )
        self.payload = None
        return self.perform(effects)

    def perform(self, effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
        before = self.report_seq
        done = super().perform(effects)
        for seq in range(before + 1, self.report_seq + 1):
            self.sent_at[seq] = self.now
        return done

    def ask(self) -> None:
        """Note since when upstream is at rest, apart from the gate's own view."""
        if self.wished is not None:
            self.wish_at = self.now
        if self.wished is not None and self.wished != REST:
            self.rest_since = None
        elif self.rest_since is None and (
            self.wished is not None or self.now - self.wish_at > 0.5
        ):
            self.rest_since = self.now
        super().ask()

    def hear(self, feedback: Feedback | None = None, topic: str = "AGII") -> None:
        told = feedback or self.feedback()
        self.feedbacks.append(told)
        seen = self.sent_at.get(told.seen.get("AGI", -1))
        if seen is not None:
            self.heard = seen if self.heard is None else max(seen, self.heard)
        super().hear(told, topic)

    def deliver(self, payload: bytes) -> None:
        self.commands.append(payload)
        self.payload = payload
        self.command(payload)

    # --- events ---------------------------------------------------------------------

    def wait(self, seconds: float) -> None:
        self.run(seconds)

    def press(self, name: str) -> None:
        self.deliver(stop(name))

    def say(self, payload: bytes) -> None:
        self.deliver(payload)

    def ask_release(self, kind: str) -> None:
        remote = sorted(self.machine.holds.remote)
        everything = [hold.id for hold in self.machine.holds.holds]
        ids = {"fewer": remote[1:], "all": everything}.get(kind, remote)
        named = f"t{len(self.commands)}"
        self.deliver(release(ids or ["nobody"], self.challenge(kind), named))

    def ask_resume(self, kind: str) -> None:
        named = f"t{len(self.commands)}"
        self.deliver(resume(self.challenge(kind), named))

    def challenge(self, kind: str) -> str:
        """An earlier one if it is to be ``old``, else the present one."""
        now = self.machine.challenge
        earlier = next((one for one in self.challenges if one != now), "none")
        return earlier if kind == "old" else now

    def again(self, which: int) -> None:
        for payload in self.commands[which % max(1, len(self.commands)) :][:1]:
            self.deliver(payload)

    def hear_again(self, which: int) -> None:
        for feedback in self.feedbacks[which % max(1, len(self.feedbacks)) :][:1]:
            self.hear(feedback)

    def keep_desired_state(self, desired: str, ids: list[str]) -> None:
        self.level(desired, *ids)

    def local(self, source: Literal["hw", "bumper"]) -> None:
        self.call(lambda: self.machine.local_hold(source, self.now))

    def crew(self) -> None:
        self.call(lambda: self.machine.release_locally(self.now))

    def iveg(self, speaks: bool) -> None:
        self.speaks = speaks

    def sensors(self, work: bool) -> None:
        self.odometry = work

    def push(self, speed: float) -> None:
        self.obeys, self.speed = speed == 0.0, Twist2D(speed, 0.0)

    def upstream(self, wished: Twist2D | None) -> None:
        self.wished = wished

    def meet(self, x: float | None) -> None:
        self.alerts = () if x is None else (person(x),)

    def speed_limit(self, factor: float) -> None:
        self.speed_limits = {"AGI": SpeedLimit(factor, "person")}

    def reboot(self) -> None:
        """Power goes and comes; what was not on the disk is gone."""
        self.now += 5.0
        self.boot = f"b{int(self.boot[1:]) + 1}"
        self.machine = self.start()
        self.sent_at, self.heard, self.rest_since = {}, None, None
        self.wish_at = -1e9
        self.call(lambda: self.machine.tick(self.now))
        self.boots.append(self.transitions[-1])

    def cut(self, name: str, performed: int) -> None:
        """Power goes after so many effects of a STOP."""
        self.commands.append(stop(name))
        effects = self.machine.command(stop(name), self.now)
        for effect in effects[:performed]:
            self.disk = effect.holds if isinstance(effect, Persist) else self.disk
        self.reboot()

    def full_speed(self) -> None:
        """What a perfect iVeg and a perfect upstream do; may fail while things hold."""
        self.speaks = self.odometry = True
        self.push(0.0)
        self.wished = REST
        self.run(0.8)
        self.crew()
        self.ask_release("perfect")
        self.ask_resume("perfect")
        self.run(0.6)
        self.wished = AHEAD
        self.run(1.5)

    def episode(self, button: bool, released: str, resumed: str) -> None:
        """Two people stop it, perhaps a crew too; then somebody wants it to drive.

        Args:
            button: Whether somebody presses the red button too.
            released: Kind of the release.
            resumed: What is asked in turn: ``release`` and kinds of resume.
        """
        self.sensors(True)
        self.push(0.0)
        self.press("01A")
        self.press("01B")
        for _ in range(button):
            self.local("hw")
        self.run(0.3)
        for kind in resumed.split():
            ask = self.ask_release if kind == "release" else self.ask_resume
            ask(released if kind == "release" else kind)
        self.run(0.3)

    def lose_iveg(self) -> None:
        """Silence until the ``link`` hold, then words again for a while."""
        self.speaks = False
        self.run(3.9)
        self.speaks = True
        self.run(1.6)


NAMES = st.sampled_from(["01A", "01B", "01C"])

RELEASES = st.sampled_from(["perfect", "old", "fewer", "all"])
TURNS = st.sampled_from(["release perfect", "perfect release", "release old"])
RESUMES = st.sampled_from(["perfect", "old"])


def _event(name: str, *values: st.SearchStrategy[object]) -> st.SearchStrategy[Event]:
    return st.builds(Event, st.just(name), st.tuples(*values))


JUNK = st.one_of(
    st.binary(max_size=20),
    st.sampled_from(
        [
            b"STOP",
            b'{"cmd": {"stop": null}}',
            b'{"cmd": {"release": {"ids": ["01A"], "ch": "c"}}}',
            b'{"cmd": {"resume": {"ch": "c"}}}',
            b"[[[[",
            b"null",
        ]
    ),
)

EVENTS = st.lists(
    st.one_of(
        _event("full_speed"),
        _event("lose_iveg"),
        _event("episode", st.booleans(), RELEASES, TURNS),
        _event("wait", st.sampled_from([0.05, 0.2, 0.6, 1.3, 3.4])),
        _event("press", NAMES),
        _event("say", JUNK),
        _event("ask_release", RELEASES),
        _event("ask_resume", RESUMES),
        _event("again", st.integers(0, 40)),
        _event("hear_again", st.integers(0, 400)),
        _event(
            "keep_desired_state",
            st.sampled_from(["stopped", "run"]),
            st.lists(NAMES, max_size=2),
        ),
        _event("local", st.sampled_from(["hw", "bumper"])),
        _event("crew"),
        _event("iveg", st.booleans()),
        _event("sensors", st.booleans()),
        _event("push", st.sampled_from([0.0, 0.01, 0.3, -0.3])),
        _event("upstream", st.sampled_from([None, REST, AHEAD, SLOWLY])),
        _event("meet", st.sampled_from([None, 0.5, 1.9, 2.2, 2.4, 5.0])),
        _event("speed_limit", st.sampled_from([0.0, 0.5, 1.0])),
        _event("reboot"),
        _event("cut", NAMES, st.integers(0, 4)),
    ),
    max_size=10,
)


def played(events: list[Event]) -> World:
    """The events, on a robot that was driving at full speed when they began."""
    return World().play([Event("full_speed"), *events])


def reports(world: World) -> Iterator[tuple[Transition, float]]:
    """Every factor that was reported, with the call that reported it."""
    for transition in world.transitions:
        for effect in transition.effects:
            if isinstance(effect, Report):
                yield transition, effect.report.speed_factor
