"""The life of a STOP, one machine a robot: state × event → new state and effects.

::

    RUNNING ──> REQUESTED ──> SENT ──> DELIVERED ──> STANDING <──> STALE
       ^            │  │        │          └──> STILL_MOVING ──┘ │
       │            │  └────────┴─> UNCONFIRMED ─────────────────┤
       │            └<── moved, hold lost, release unconfirmed ──┤
       └── READY <────────────── RELEASING <─────────────────────┘

The operator's press is one fact, the robot's standstill another.  A STOP stays
wanted, and is repeated, until the robot has reported the release of our own hold.  A
RELEASE is sent once on each transport, for the holds that a person saw; if the robot
does not confirm it, it becomes a STOP.

Every input has a method: people, transports, the robot, time.  The method asks the
guard that may refuse an order, and names the event.  The table at the end, ``STEPS``,
says what follows.  An event without a row is a mistake in this module: nothing changes,
``OffTable`` reports it, and STOP is repeated as before.

Last come the alert conditions of all STOPs of a fleet.
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
    is_held,
    may_drive,
)
from iveg.domain.transports import TRANSPORTS, Transport, TransportId

_UNDELIVERED: tuple[State, ...] = ("REQUESTED", "SENT", "UNCONFIRMED")


class StopMachine(StopStatus):
    """One robot's STOP.

    Each method takes one input and returns the effects, to be carried out in order.

    Args:
        robot_id: The robot.
        transports: All transports to it.
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
        # A RELEASE under way may still lift the present hold: begin an episode.
        if not self.wants_stop or self.state == "RELEASING":
            return self._stop_again("requested", at, new_id, by, press)
        self._joined_at = at.mono
        effects: list[Effect] = []
        if self.state != "STANDING":
            self._timetable.now(at)
            effects = self._send_due(at)
        if self.stop is None or by in self.stop.requesters:
            return effects
        # One more person wants the STOP: nothing changes but the audit.
        self.stop = replace(self.stop, requesters=(*self.stop.requesters, by))
        return [*effects, self._changed("requested", f"joined by {by}")]

    def restore(self, wanted: DesiredRecord, at: Instant, new_id: str) -> list[Effect]:
        """STOP again a robot that an earlier run had stopped."""
        return self._step(
            Event("reasserted", at, new_id, wanted.by, kept=wanted.hold_to_assert())
        )

    def release(
        self, by: str, seen: Iterable[str], at: Instant, new_id: str
    ) -> list[Effect]:
        """Send a RELEASE of exactly the holds that a person saw.

        Raises:
            CommandRefusedError: it must not happen now (I2).
        """
        challenge, remote = self.evidence.check_release(
            self.state, at, seen, self._joined_at
        )
        return self._begin_order(Event("releasing", at, new_id, by), challenge, remote)

    def resume(self, by: str, at: Instant, new_id: str) -> list[Effect]:
        """Let a released robot drive; raises like ``release``."""
        challenge = self.evidence.check_resume(self.state, at)
        return self._begin_order(Event("resuming", at, new_id, by), challenge)

    def _begin_order(
        self, event: Event, challenge: str, ids: tuple[str, ...] = ()
    ) -> list[Effect]:
        # After a refusal a robot that iVeg has not stopped is RUNNING again.
        before: State = "RUNNING" if self.stop is None else self.state
        command = event.new_command(self.robot_id, self._transports.values())
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
        handed_over: Instant | None = None,
    ) -> list[Effect]:
        """Note that a transport took our message (PUBACK, 2xx) or failed.

        Neither proves that the robot has the message.

        Args:
            transport: The transport.
            command_id: The command that was sent.
            at: When the transport answered.
            ok: Whether the transport took the message.
            doubtful: Whether the next hop is known to pass nothing on.
            handed_over: When the transport got the message; None: at ``at``.
        """
        command = self._find(command_id)
        if command is None:
            return []  # The command's episode has ended meanwhile.
        if command.kind == "stop":
            self._timetable.came_back(transport, at)
        way = self._transports[transport]
        self._keep(command.sent(way, handed_over or at, ok=ok, doubtful=doubtful))
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
            # The deciding report may have come before this answer.
            decided = self.attempt.is_refused(self.evidence.report, self.hold_id)
            if answer.result == "REFUSED" and decided:
                return self._step(Event("refused", at))
            return []
        is_ours = answer.id == self.hold_id
        if self.wants_stop and answer.result == "RELEASED" and is_ours:
            # A robot never takes a released id again, so the STOP needs a new one.
            return self._hold_lost(at, new_id, is_released=True)
        ids = {answer.id, *(hold.id for hold in answer.holds)}
        if self.stop is None or answer.result != "LATCHED" or self.hold_id not in ids:
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
        """Take the robot's newest safety report by (boot, seq).

        Args:
            report: The report.
            at: When it came.
            transport: The transport that brought it.
            new_id: Id of the STOP that may begin.
            age_s: Its greatest age when it came (s).
            sparse: Whether its topic has two reports a second, not ten.
        """
        if not self.evidence.note_report(report, at, age_s, self.hold_id):
            return []
        # An older report may show the robot before this episode.
        is_later = at.mono - age_s >= self._begun_at
        if self.state in ("RUNNING", "READY"):
            return self._reported_free(report, at, is_later=is_later)
        if self.attempt is not None:
            verdict = self.attempt.verdict(report, self.hold_id)
            return [] if verdict is None else self._step(Event(verdict, at))
        assert self.stop is not None  # noqa: S101 - every such state has an episode
        has_stood = self.state in ("STANDING", "STALE")
        if not is_held(report, self.hold_id):
            self.evidence.standstill.forget()
            is_released = self.hold_id in report.released
            # Before it stood, the report may have left before the STOP arrived.
            if not is_later or not (has_stood or is_released):
                return []
            return self._hold_lost(
                at, new_id, is_released=is_released, is_free=may_drive(report)
            )
        # With another challenge no copy of the release can lift our hold any more.
        if report.challenge != self._open_challenge:
            self._open_challenge = None
        self.stop = self.stop.confirmed(transport, at)
        effects = self._delivered(at)
        match self.evidence.motion(report, at, sparse=sparse):
            case "moves" if has_stood:
                effects += self._stop_again("moved", at, new_id)
            case "stands" if self.state != "STANDING":
                effects += self._step(Event("standing", at))
        return effects

    def _reported_free(
        self, report: SafetyReport, at: Instant, *, is_later: bool
    ) -> list[Effect]:
        """Take the report of a robot that iVeg does not hold."""
        if self.state == "READY" and may_drive(report) and is_later:
            return self._step(Event("running", at))
        own_holds = self.evidence.ours
        # An older report may name a hold of an earlier boot, long lifted.
        if own_holds and self.evidence.evidence_age(at) <= LIMITS.report_stale_s:
            return self._step(Event("adopted", at, own_holds[-1]))
        return []

    def odometry(
        self,
        odometry: Odometry,
        at: Instant,
        new_id: str,
        age_s: float,
        motion: Motion = UNMOVED,
    ) -> list[Effect]:
        """Take odometry, proven to be at most ``age_s`` old.

        ``motion``: Motion of the robot by all its sources.
        """
        contradicted = self.evidence.is_contradicted(odometry, motion, at, age_s)
        if contradicted and self.state == "STANDING":
            return self._stop_again("moved", at, new_id)
        return []

    def _delivered(self, at: Instant) -> list[Effect]:
        return self._step(Event("delivered", at)) if self.state in _UNDELIVERED else []

    def _hold_lost(
        self, at: Instant, new_id: str, *, is_released: bool, is_free: bool = False
    ) -> list[Effect]:
        """STOP again: the hold is lost without a RELEASE of ours.

        An adopted hold belongs to another server.  The robot's report of its release
        ends it.
        """
        if is_released and self.stop is not None and self.stop.is_adopted:
            effects = self._step(Event("ready", at))
            return effects + self._step(Event("running", at)) if is_free else effects
        key: Key = "moved" if self._open_challenge is None else "release_unconfirmed"
        return self._stop_again(key, at, new_id)

    # --- time ---------------------------------------------------------------------

    def tick(self, now: Instant, new_id: str) -> list[Effect]:
        """Let time pass: deadlines first, then repetitions that are due."""
        effects = self._overdue(now, new_id)
        # Beside a RELEASE no STOP goes out, unless an event had no row in the table.
        if not self.wants_stop or (self.state == "RELEASING" and not self._had_no_row):
            return effects
        return [*effects, *self._send_due(now)]

    def _overdue(self, now: Instant, new_id: str) -> list[Effect]:
        is_late = now.mono >= self._deadline
        # A late RELEASE may have lifted the hold, and no report shows it: hold anew.
        if self._is_hold_doubtful(now):
            return self._step(Event("release_unconfirmed", now, new_id))
        match self.state:
            case "REQUESTED" | "SENT" if is_late:
                return self._step(Event("unconfirmed", now))
            case "DELIVERED" if is_late:
                return self._step(Event("still_moving", now))
            case "STANDING" if self.evidence.evidence_age(now) > LIMITS.report_stale_s:
                return self._step(Event("stale", now))
            case "RELEASING" if is_late:
                # No report decided the order in time: it becomes a STOP (I7).
                return self._stop_again("release_unconfirmed", now, new_id)
        return []

    def _stop_again(
        self, key: Key, at: Instant, new_id: str, by: str = "iveg", press: Press = PLAIN
    ) -> list[Effect]:
        """Begin a new episode of a robot that may be held already."""
        kept = self._hold_to_keep(at, expired=key == "release_unconfirmed")
        return self._step(Event(key, at, new_id, by, press, kept))

    # --- a step -------------------------------------------------------------------

    def _step(self, event: Event) -> list[Effect]:
        """Carry out the step of the table, or report that there is none."""
        step = self._steps.get((self.state, event.key))
        self._had_no_row = step is None
        if step is None:
            return [OffTable(self.robot_id, self.state, event.key)]
        attempt = self.attempt
        before: State = "RUNNING" if attempt is None else attempt.before
        self.state = step.to or before
        effects = [] if step.action is None else step.action(self, event)
        for command in self.commands:
            self._keep(replace(command, state=self.state))
        reason = attempt.refused if attempt and event.key == "refused" else None
        effects = [*effects, self._changed(event.key, reason)]
        # The effects above still show the commands that end here.
        self.attempt = self.attempt if step.ends == "nothing" else None
        self.stop = None if step.ends == "all" else self.stop
        return effects

    # --- actions of the steps -----------------------------------------------------

    def _begin(self, event: Event) -> list[Effect]:
        """Begin an episode, under an id that was never used before."""
        effects = self._new_episode(event, LIMITS.unconfirmed_after_s)
        # The sends come first: nothing delays the first byte of a STOP (I5).
        return [*self._send_due(event.at), *effects]

    def _adopt(self, event: Event) -> list[Effect]:
        """Take over a hold of iVeg that another process made."""
        return self._new_episode(event, LIMITS.braking_most_s)

    def _new_episode(self, event: Event, within_s: float) -> list[Effect]:
        # First, since the new commands below replace those that end.
        closing = self._closed_by(event.key)
        self.stop = event.new_command(self.robot_id, self._transports.values())
        self.attempt, self._open_challenge = None, event.kept.challenge
        self._begun_at, self._deadline = event.at.mono, event.at.mono + within_s
        self.evidence.standstill.forget()
        self._timetable.begin(event.at)
        hold_id = event.kept.hold_id or event.new_id
        return [SetDesiredState(self.robot_id, "stopped", (hold_id,)), *closing]

    def _allow_braking(self, event: Event) -> list[Effect]:
        braking = (
            self.evidence.speed / LIMITS.least_braking_m_s2 + LIMITS.braking_extra_s
        )
        # Braking begins when the robot has the STOP; out of reach it could not brake.
        self._deadline = event.at.mono + min(braking, LIMITS.braking_most_s)
        return []

    def _note_standstill(self, event: Event) -> list[Effect]:
        if self.stop is not None:
            self.stop = self.stop.stood(self.evidence.standstill.since or event.at)
        return []

    def _repeat_at_once(self, _: Event) -> list[Effect]:
        self.evidence.standstill.forget()
        self._timetable.repeat_now()
        return []

    def _send_once(self, event: Event) -> list[Effect]:
        self.attempt = event.attempt
        assert self.attempt is not None  # noqa: S101 - _begin_order sets it
        self._deadline = event.at.mono + LIMITS.release_within_s
        named = self.attempt.ids
        own_holds = tuple(hold for hold in self.evidence.ours if hold in named)
        return [SendOnce(self.attempt, own_holds)]

    def _note_refusal(self, _: Event) -> list[Effect]:
        if self.attempt is not None:
            self._keep(replace(self.attempt.command, reason=self.attempt.refused))
        return []

    def _publish_run(self, _: Event) -> list[Effect]:
        return [SetDesiredState(self.robot_id, "run", ())]

    def _send_due(self, at: Instant) -> list[Effect]:
        assert self.stop is not None  # noqa: S101 - callers have begun an episode
        sends = self._timetable.due(self.stop, at)
        # Repetitions to a standing robot are upkeep, not tries.
        if sends and self.state != "STANDING":
            self.stop = replace(self.stop, tries=self.stop.tries + 1)
        return [*sends]


@dataclass(frozen=True, slots=True)
class Step:
    """The transition of an event.

    Attributes:
        to: The new state; None: the state in which the release or resume began.
        action: Changes the machine and returns the effects, but for ``Changed``;
            None: there are none.
        ends: Commands that end with the event: none, the release or resume, or all.
    """

    to: State | None
    action: Callable[[StopMachine, Event], list[Effect]] | None = None
    ends: Literal["nothing", "order", "all"] = "nothing"


def _rows() -> Iterable[tuple[Key, tuple[State, ...], Step]]:
    """Rows of the table: event, states in which it may come, transition."""
    machine, any_state = StopMachine, get_args(State)
    stop = Step("REQUESTED", machine._begin)
    order = Step("RELEASING", machine._send_once)
    yield "requested", any_state, stop
    yield "reasserted", any_state, stop
    yield "moved", any_state, stop
    yield "release_unconfirmed", any_state, stop
    yield "sent", ("REQUESTED",), Step("SENT")
    yield "delivered", _UNDELIVERED, Step("DELIVERED", machine._allow_braking)
    yield "unconfirmed", ("REQUESTED", "SENT"), Step("UNCONFIRMED")
    yield "still_moving", ("DELIVERED",), Step("STILL_MOVING")
    moving: tuple[State, ...] = ("DELIVERED", "STILL_MOVING", "STALE")
    yield "standing", moving, Step("STANDING", machine._note_standstill)
    yield "stale", ("STANDING",), Step("STALE", machine._repeat_at_once)
    # RUNNING: iVeg has not stopped it, but its boot may hold it.
    yield "releasing", ("STANDING", "RUNNING"), order
    yield "resuming", ("READY", "RUNNING"), order
    yield "refused", ("RELEASING",), Step(None, machine._note_refusal, "order")
    ready = Step("READY", machine._publish_run, "order")
    yield "ready", ("RELEASING", "STANDING", *moving), ready
    yield "running", ("RELEASING", "READY"), Step("RUNNING", ends="all")
    yield "adopted", ("RUNNING", "READY"), Step("DELIVERED", machine._adopt)


STEPS: Mapping[tuple[State, Key], Step] = {
    (state, key): step for key, states, step in _rows() for state in states
}


_ALERTS = {
    "UNCONFIRMED": "alert.stop_unconfirmed",
    "STILL_MOVING": "alert.stop_still_moving",
}
_NOT_AT_REST = {"REQUESTED", "SENT", "DELIVERED", *_ALERTS}
"""States of an episode in which the robot has not stood yet."""


def stop_conditions(
    machines: Iterable[StopMachine], now: Instant
) -> Iterable[Condition]:
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
