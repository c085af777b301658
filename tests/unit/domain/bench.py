"""A STOP machine on a bench: its clock is moved by hand, its robot is told."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Any

from iveg.domain.observations import UNKNOWN_ORIGIN, CommandAnswer, Hold, Origin
from iveg.domain.stop import (
    Changed,
    Effect,
    SendOnce,
    SendStop,
    SetDesiredState,
    StopMachine,
)
from iveg.domain.stop.commands import FollowedCommand
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from tests.builders import at, odometry, safety_report

BOOT_HOLD = Hold("boot-b1", "boot", "remote")
CHALLENGE, NEXT_CHALLENGE = "0123456789abcdef", "fedcba9876543210"
RED_BUTTON = Hold("hw-1", "hw", "local")


@dataclass
class Bench:
    """One machine with a clock that is moved by hand and a robot that is told."""

    direct: bool = True
    now: float = 0.0
    log: list[Effect] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.machine = StopMachine("AGI", (DIRECT.switched(on=self.direct), FIWARE))
        self._ids = itertools.count(1)
        self._answers = itertools.count(1)

    def new_id(self) -> str:
        return f"id-{next(self._ids)}"

    def keep(self, effects: list[Effect]) -> list[Effect]:
        self.log += effects
        return effects

    # --- what happens -------------------------------------------------------------

    def press(self, by: str = "ana") -> list[Effect]:
        return self.keep(self.machine.press(by, at(self.now), self.new_id()))

    def sent(
        self, transport: TransportId = DIRECT.id, *, ok: bool = True
    ) -> list[Effect]:
        command_id = self.stop.command_id
        return self.keep(self.machine.sent(transport, command_id, at(self.now), ok=ok))

    def report(
        self,
        *holds: Hold,
        factor: float = 0.0,
        transport: TransportId = DIRECT.id,
        sparse: bool = False,
        **also: Any,
    ) -> list[Effect]:
        """The robot reports its holds and ``also`` what a ``safety_report`` has."""
        report = safety_report("AGI", *holds, speed_factor=factor, **also)
        moment, new_id = at(self.now), self.new_id()
        return self.keep(
            self.machine.reported(report, moment, transport, new_id, sparse=sparse)
        )

    def answer(
        self,
        result: str = "LATCHED",
        *,
        id: str | None = None,  # noqa: A002 - the wire's word
        why: str | None = None,
        seq: int | None = None,
        attempt: str | None = None,
        transport: TransportId = DIRECT.id,
    ) -> list[Effect]:
        number = next(self._answers) if seq is None else seq
        named = self.machine.hold_id if id is None else id
        if attempt is None and result != "LATCHED" and self.machine.order is not None:
            attempt = self.attempt
        origin = Origin("b1", number)
        answer = CommandAnswer("AGI", origin, named, result, why=why, attempt=attempt)
        return self.keep(
            self.machine.answered(answer, at(self.now), transport, self.new_id())
        )

    def odometry(self, linear: float, angular: float = 0.0) -> list[Effect]:
        return self.keep(
            self.machine.odometry(
                odometry(linear=linear, angular=angular, origin=UNKNOWN_ORIGIN),
                at(self.now),
                self.new_id(),
                inf,
            )
        )

    def tick(self) -> list[Effect]:
        return self.keep(self.machine.tick(at(self.now), self.new_id()))

    def wait(self, seconds: float) -> list[Effect]:
        """Let time pass in the loop's ticks; returns what was done in it."""
        before = len(self.log)
        for _ in range(round(seconds / 0.05)):
            self.now = round(self.now + 0.05, 6)
            self.tick()
        return self.log[before:]

    # --- shorthands ---------------------------------------------------------------

    @property
    def state(self) -> str:
        return self.machine.state

    @property
    def ours(self) -> Hold:
        assert self.machine.hold_id is not None
        return Hold(self.machine.hold_id, "iveg", "remote")

    @property
    def stop(self) -> FollowedCommand:
        """The STOP that is wanted."""
        assert self.machine.stop is not None
        return self.machine.stop

    @property
    def once(self) -> FollowedCommand:
        """The release or resume under way."""
        assert self.machine.order is not None
        return self.machine.order

    @property
    def attempt(self) -> str:
        """Of the release or resume under way."""
        return self.once.command_id

    def stand(self, *also: Hold) -> "Bench":
        """Report our hold at rest until the machine believes it."""
        for _ in range(12):
            self.report(self.ours, *also)
            self.wait(0.1)
        assert self.state == "STANDING"
        self.report(self.ours, *also)
        return self

    def release(self, *ids: str) -> list[Effect]:
        return self.keep(self.machine.release("ana", ids, at(self.now), self.new_id()))

    def resume(self) -> list[Effect]:
        return self.keep(self.machine.resume("ana", at(self.now), self.new_id()))

    def ready(self) -> "Bench":
        """A robot that was stopped, stood, and reported the release."""
        self.press()
        self.stand()
        ours = self.ours.id
        self.release(ours)
        self.report(released=(ours,))
        assert self.state == "READY"
        return self

    def changes(self) -> list[str]:
        return [one.key for one in self.log if isinstance(one, Changed)]


def sends(effects: list[Effect], transport: str | None = None) -> list[SendStop]:
    return [
        one
        for one in effects
        if isinstance(one, SendStop) and transport in (None, one.transport)
    ]


def once(effects: list[Effect]) -> list[SendOnce]:
    return [one for one in effects if isinstance(one, SendOnce)]


def levels(effects: list[Effect]) -> list[str]:
    return [one.desired for one in effects if isinstance(one, SetDesiredState)]


def pressed() -> Bench:
    bench = Bench()
    bench.press()
    return bench


def standing(*also: Hold) -> Bench:
    return pressed().stand(*also)


def releasing() -> Bench:
    """A robot that stood and is being released."""
    bench = standing()
    bench.release(bench.ours.id)
    return bench


def _after(*steps: Callable[[Bench], object]) -> Callable[[], Bench]:
    """Makes a robot whose STOP was asked for and to which this happened then."""

    def make() -> Bench:
        bench = pressed()
        for step in steps:
            step(bench)
        return bench

    return make


IN_STATE: dict[str, Callable[[], Bench]] = {
    "RUNNING": Bench,
    "REQUESTED": pressed,
    "SENT": _after(Bench.sent),
    "DELIVERED": _after(lambda bench: bench.report(bench.ours)),
    "UNCONFIRMED": _after(lambda bench: bench.wait(1.1)),
    "STALE": _after(Bench.stand, lambda bench: bench.wait(2.0)),
    "READY": lambda: Bench().ready(),
}
