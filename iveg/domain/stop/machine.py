"""The life of a STOP, one machine a robot: state × event → new state and effects.

::

    RUNNING ──> REQUESTED ──> SENT ──> DELIVERED ──> STANDING <──> STALE
       ^            │  │        │          └──> STILL_MOVING ──┘ │
       │            │  └────────┴─> UNCONFIRMED ─────────────────┤
       │            └<── moved, hold lost, release unconfirmed ──┤
       └── READY <────────────── RELEASING <─────────────────────┘

The operator's press is one fact; that the robot stands still is another.  STOP is
wanted until the robot has reported the release of our own hold, and is sent for so
long.  A RELEASE is sent once on each transport, for the holds that a person saw;
unconfirmed it becomes a STOP.

What happens comes in by a method, from people, transports, the robot or time.  The
method finds out which event that is (after the guard that may refuse an order) and the
table at the end, ``STEPS``, says what follows.  An event without a row is a mistake in
this module: nothing changes, ``OffTable`` reports it, and STOP is sent on.

Alert conditions of the STOPs of a fleet.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Literal, get_args

from iveg.domain.events import Condition
from iveg.domain.limits import LIMITS
from iveg.domain.motion import UNMOVED, Motion
from iveg.domain.observations import CommandAnswer, Instant, Odometry, SafetyReport
from iveg.domain.stop.commands import PLAIN, Press, State
from iveg.domain.stop.status import (
    Attempt,
    DesiredRecord,
    Effect,
    Event,
    Key,
    OffTable,
    SendOnce,
    SetDesiredState,
    StopStatus,
    drives,
)
from iveg.domain.transports import TRANSPORTS, Transport, TransportId

_UNHEARD: tuple[State, ...] = ("REQUESTED", "SENT", "UNCONFIRMED")


class StopMachine(StopStatus):
    """One robot's STOP.

    Everything that can happen to it is a method; each returns what the world is asked
    to do, in this order.

    Args:
        robot_id: Whose.
        transports: The ways to it.
        steps: The table; a test takes rows away.
    """

    def __init__(
        self,
        robot_id: str,
        transports: Iterable[Transport] = TRANSPORTS,
        steps: "Mapping[tuple[State, Key], Step] | None" = None,
    ) -> None:
        super().__init__(robot_id, transports)
        self._steps = STEPS if steps is None else steps

    # --- people -------------------------------------------------------------------

    def press(
        self, by: str, at: Instant, new_id: str, *, press: Press = PLAIN
    ) -> list[Effect]:
        """STOP: always accepted; a press during an episode joins it."""
        if not self.wants_stop or self.state == "RELEASING":
            return self._stop_again("requested", at, new_id, by, press)
        self._joined_at = at.mono
        effects: list[Effect] = []
        if self.state != "STANDING":
            self._sends.now(at)
            effects = self._send_due(at)
        if self.stop is None or by in self.stop.requesters:
            return effects
        # One more person wants it: nothing changes but the audit.
        self.stop = replace(self.stop, requesters=(*self.stop.requesters, by))
        return [*effects, self._changed("requested", self.stop, f"joined by {by}")]

    def restore(self, wanted: DesiredRecord, at: Instant, new_id: str) -> list[Effect]:
        """STOP again a robot that an earlier run had stopped."""
        kept = wanted.hold_to_assert()
        return self._step(Event("reasserted", at, new_id, wanted.by, kept=kept))

    def release(
        self, by: str, seen: Iterable[str], at: Instant, new_id: str
    ) -> list[Effect]:
        """Lift exactly the holds that a person saw. Raises likewise."""
        challenge, remote = self.evidence.check_release(
            self.state, at, seen, self._joined_at
        )
        return self._order(Event("releasing", at, new_id, by), challenge, remote)

    def resume(self, by: str, at: Instant, new_id: str) -> list[Effect]:
        """Let a released robot drive. Raises likewise."""
        challenge = self.evidence.check_resume(self.state, at)
        return self._order(Event("resuming", at, new_id, by), challenge)

    def _order(
        self, event: Event, challenge: str, ids: tuple[str, ...] = ()
    ) -> list[Effect]:
        # Refused, a robot that iVeg has not stopped is what it was before: running.
        before: State = "RUNNING" if self.stop is None else self.state
        command = event.begins(self.robot_id, self._transports.values())
        attempt = Attempt(command, challenge, ids, before)
        return self._step(replace(event, attempt=attempt))

    # --- transports ---------------------------------------------------------------

    def sent(
        self,
        transport: TransportId,
        command_id: str,
        at: Instant,
        *,
        ok: bool,
        doubtful: bool = False,
        left: Instant | None = None,
    ) -> list[Effect]:
        """A transport took our message (PUBACK, 2xx) or failed; neither is evidence.

        ``doubtful``: what lies behind is known to pass nothing on.  ``left``: when it
        was handed to the transport; this moment if None.
        """
        command = self._find(command_id)
        if command is None:
            return []  # Its episode has ended meanwhile.
        if command.kind == "stop":
            self._sends.came_back(transport, at)
        way = self._transports[transport]
        self._keep(command.sent(way, left or at, ok=ok, doubtful=doubtful))
        if not ok or doubtful or self.state != "REQUESTED":
            return []
        return self._step(Event("sent", at))

    # --- the robot ----------------------------------------------------------------

    def answered(
        self, answer: CommandAnswer, at: Instant, transport: TransportId, new_id: str
    ) -> list[Effect]:
        """Take the robot's own answer on ``cmdexe`` or ``cmd_info``."""
        if self.attempt is not None:
            if answer.attempt != self.attempt.command.command_id:
                return []
            self.attempt = self.attempt.answered(answer, transport, at)
            # Its report may have come before the answer.
            decided = self.attempt.is_refused(self.evidence.report, self.hold_id)
            refused = answer.result == "REFUSED" and decided
            return self._step(Event("refused", at)) if refused else []
        if self.wants_stop and answer.result == "RELEASED":
            # It will never hold by that name again: only a new one can.
            is_ours = answer.id == self.hold_id
            return self._lifted(at, new_id, is_ours) if is_ours else []
        held = {answer.id, *(hold.id for hold in answer.holds)}
        if self.stop is None or answer.result != "LATCHED" or self.hold_id not in held:
            return []
        self.stop = self.stop.answered(transport, at)
        return self._delivered(at)

    def reported(
        self,
        report: SafetyReport,
        at: Instant,
        transport: TransportId,
        new_id: str,
        age_s: float = 0.0,
        *,
        sparse: bool = False,
    ) -> list[Effect]:
        """Take the robot's safety report, new by (boot, seq), ``age_s`` old at most.

        ``sparse``: it came on a topic that has two of them a second, not ten.
        """
        if not self.evidence.note_report(report, at, age_s, self.hold_id):
            return []
        is_later = at.mono - age_s >= self._begun_at
        if self.state == "READY" and drives(report) and is_later:
            return self._step(Event("running", at))
        if self.state in ("RUNNING", "READY"):
            # A hold that this process did not ask for is not dropped while it is news.
            ours = self.evidence.ours[-1:] if age_s <= LIMITS.report_stale_s else []
            return self._step(Event("adopted", at, ours[0])) if ours else []
        if self.attempt is not None:
            verdict = self.attempt.verdict(report, self.hold_id)
            return [] if verdict is None else self._step(Event(verdict, at))
        assert self.stop is not None  # noqa: S101 - every such state has an episode
        has_stood = self.state in ("STANDING", "STALE")
        if self.hold_id not in {hold.id for hold in report.holds}:
            self.evidence.standstill.forget()
            is_released = self.hold_id in report.released
            if not is_later or not (has_stood or is_released):
                return []
            is_driving = drives(report)
            return self._lifted(at, new_id, is_released, is_driving=is_driving)
        if report.challenge != self._doubt:
            self._doubt = None
        self.stop = self.stop.heard_of(transport, at)
        effects = self._delivered(at)
        match self.evidence.motion(report, at, sparse=sparse):
            case "moves" if has_stood:
                effects += self._stop_again("moved", at, new_id)
            case "stands" if self.state != "STANDING":
                effects += self._step(Event("standing", at))
        return effects

    def odometry(
        self,
        said: Odometry,
        at: Instant,
        new_id: str,
        age_s: float,
        motion: Motion = UNMOVED,
    ) -> list[Effect]:
        """Take odometry, proven to be no older than ``age_s``.

        ``motion``: of the robot by all that is known.
        """
        contradicted = self.evidence.is_contradicted(said, motion, at, age_s)
        moved = contradicted and self.state == "STANDING"
        return self._stop_again("moved", at, new_id) if moved else []

    def _delivered(self, at: Instant) -> list[Effect]:
        return self._step(Event("delivered", at)) if self.state in _UNHEARD else []

    def _lifted(
        self, at: Instant, new_id: str, is_released: bool, *, is_driving: bool = False
    ) -> list[Effect]:
        """The hold is lost without a release of ours: STOP again.

        One that was adopted, and that nobody here asked for, is another server's: the
        robot's word that it was released ends it.
        """
        stop = self.stop
        if is_released and stop and (*stop.requesters, stop.reason) == ("iveg", None):
            effects = self._step(Event("ready", at))
            return effects + self._step(Event("running", at)) if is_driving else effects
        lost: Key = "moved" if self._doubt is None else "release_unconfirmed"
        return self._stop_again(lost, at, new_id)

    # --- time ---------------------------------------------------------------------

    def tick(self, now: Instant, new_id: str) -> list[Effect]:
        """Let time pass: deadlines first, then what must be sent again."""
        effects = self._overdue(now, new_id)
        if not self.wants_stop or (self.state == "RELEASING" and not self._is_lost):
            return effects
        return [*effects, *self._send_due(now)]

    def _overdue(self, now: Instant, new_id: str) -> list[Effect]:
        late = now.mono >= self._deadline
        if self._is_doubtful(now):
            return self._step(Event("release_unconfirmed", now, new_id))
        match self.state:
            case "REQUESTED" | "SENT" if late:
                return self._step(Event("unconfirmed", now))
            case "DELIVERED" if late:
                return self._step(Event("still_moving", now))
            case "STANDING" if self.evidence.evidence_age(now) > LIMITS.report_stale_s:
                return self._step(Event("stale", now))
            case "RELEASING" if late:
                # Nothing decided it in time: it becomes a STOP (I7).
                return self._stop_again("release_unconfirmed", now, new_id)
        return []

    def _stop_again(
        self, key: Key, at: Instant, new_id: str, by: str = "iveg", press: Press = PLAIN
    ) -> list[Effect]:
        """A new episode of a robot that may be held already."""
        kept = self._hold_to_keep(at, expired=key == "release_unconfirmed")
        return self._step(Event(key, at, new_id, by, press, kept))

    # --- a step -------------------------------------------------------------------

    def _step(self, event: Event) -> list[Effect]:
        """Carry out the step of the table, or report that there is none."""
        step = self._steps.get((self.state, event.key))
        self._is_lost = step is None
        if step is None:
            return [OffTable(self.robot_id, self.state, event.key)]
        attempt = self.attempt
        before: State = "RUNNING" if attempt is None else attempt.before
        self.state = step.to or before
        effects = step.do(self, event)
        for command in self.commands:
            self._keep(replace(command, state=self.state))
        why = attempt.refused if attempt and event.key == "refused" else None
        effects = [*effects, self._changed(event.key, self.once or self.stop, why)]
        self.attempt = self.attempt if step.ends == "nothing" else None
        self.stop = None if step.ends == "all" else self.stop
        return effects

    # --- what the steps do --------------------------------------------------------

    def _begin(self, event: Event) -> list[Effect]:
        """A new episode, under an id that was never used before."""
        opened = self._new_episode(event, LIMITS.unconfirmed_after_s)
        return [*self._send_due(event.at), *opened]

    def _adopt(self, event: Event) -> list[Effect]:
        """A hold of iVeg that this process did not ask for is taken over."""
        return self._new_episode(event, LIMITS.braking_most_s)

    def _new_episode(self, event: Event, within_s: float) -> list[Effect]:
        closed = self._closed_by(event.key)
        self.stop = event.begins(self.robot_id, self._transports.values())
        self.attempt, self._doubt = None, event.kept.challenge
        self._begun_at, self._deadline = event.at.mono, event.at.mono + within_s
        self.evidence.standstill.forget()
        self._sends.begin(event.at)
        hold_id = event.kept.hold_id or event.new_id
        return [SetDesiredState(self.robot_id, "stopped", (hold_id,)), *closed]

    def _allow_braking(self, event: Event) -> list[Effect]:
        braking = (
            self.evidence.speed / LIMITS.least_braking_m_s2 + LIMITS.braking_extra_s
        )
        # From the robot's word on: before it, a robot out of reach could not brake.
        self._deadline = event.at.mono + min(braking, LIMITS.braking_most_s)
        return []

    def _note_standstill(self, event: Event) -> list[Effect]:
        if self.stop is not None:
            self.stop = self.stop.stood(self.evidence.standstill.since or event.at)
        return []

    def _ask_at_once(self, _: Event) -> list[Effect]:
        self.evidence.standstill.forget()
        self._sends.repeat_now()
        return []

    def _send_once(self, event: Event) -> list[Effect]:
        self.attempt = event.attempt
        assert self.attempt is not None  # noqa: S101 - whoever orders makes one
        self._deadline = event.at.mono + LIMITS.release_within_s
        named = self.attempt.ids
        return [
            SendOnce(
                self.attempt, tuple(one for one in self.evidence.ours if one in named)
            )
        ]

    def _say_why(self, _: Event) -> list[Effect]:
        if self.attempt is not None:
            self._keep(replace(self.attempt.command, reason=self.attempt.refused))
        return []

    def _let_go(self, _: Event) -> list[Effect]:
        return [SetDesiredState(self.robot_id, "run", ())]

    def _send_due(self, at: Instant) -> list[Effect]:
        assert self.stop is not None  # noqa: S101 - callers have begun an episode
        due = self._sends.due(self.stop, at)
        if due and self.state != "STANDING":
            self.stop = replace(self.stop, tries=self.stop.tries + 1)
        return [*due]


@dataclass(frozen=True, slots=True)
class Step:
    """The transition of an event.

    Attributes:
        to: The new state; None is the one that the attempt began in.
        do: What changes, and what the world is asked to do besides telling of it.
        ends: What is over after that: nothing, the release or resume, or all.
    """

    to: State | None
    do: Callable[[StopMachine, Event], list[Effect]] = lambda _machine, _event: []
    ends: Literal["nothing", "order", "all"] = "nothing"


def _rows() -> Iterable[tuple[Key, tuple[State, ...], Step]]:
    """One row an event: its states of origin and its transition."""
    m, every = StopMachine, get_args(State)
    begin, order = Step("REQUESTED", m._begin), Step("RELEASING", m._send_once)
    yield "requested", every, begin
    yield "reasserted", every, begin
    yield "moved", every, begin
    yield "release_unconfirmed", every, begin
    yield "sent", ("REQUESTED",), Step("SENT")
    yield "delivered", _UNHEARD, Step("DELIVERED", m._allow_braking)
    yield "unconfirmed", ("REQUESTED", "SENT"), Step("UNCONFIRMED")
    yield "still_moving", ("DELIVERED",), Step("STILL_MOVING")
    moving: tuple[State, ...] = ("DELIVERED", "STILL_MOVING", "STALE")
    yield "standing", moving, Step("STANDING", m._note_standstill)
    yield "stale", ("STANDING",), Step("STALE", m._ask_at_once)
    yield "releasing", ("STANDING", "RUNNING"), order
    yield "resuming", ("READY", "RUNNING"), order
    yield "refused", ("RELEASING",), Step(None, m._say_why, "order")
    yield "ready", ("RELEASING", "STANDING", *moving), Step("READY", m._let_go, "order")
    yield "running", ("RELEASING", "READY"), Step("RUNNING", ends="all")
    yield "adopted", ("RUNNING", "READY"), Step("DELIVERED", m._adopt)


STEPS: Mapping[tuple[State, Key], Step] = {
    (state, key): step for key, states, step in _rows() for state in states
}


_ALERTS = {
    "UNCONFIRMED": "alert.stop_unconfirmed",
    "STILL_MOVING": "alert.stop_still_moving",
}
_NOT_AT_REST = {"REQUESTED", "SENT", "DELIVERED", *_ALERTS}
"""A STOP in one of these has not been seen to stand, not even once."""


def of_machines(machines: Iterable[StopMachine], now: Instant) -> Iterable[Condition]:
    """Conditions of STOPs that are not confirmed or not obeyed."""
    for machine in machines:
        stop, robot_id = machine.stop, machine.robot_id
        if stop is None:
            continue
        age = round(now.mono - stop.times.requested.mono, 1)
        key = _ALERTS.get(machine.state)
        if key is not None:
            yield Condition.of_robot("P1", key, robot_id, age=age)
        if stop.reason == "moved" and machine.state in _NOT_AT_REST:
            yield Condition.of_robot("P1", "alert.stop_moved", robot_id, age=age)
