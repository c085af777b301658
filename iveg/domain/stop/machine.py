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
this module: nothing changes, ``OffTable`` tells of it, and STOP is sent on.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Literal, get_args

from iveg.domain.errors import CommandRefusedError
from iveg.domain.limits import LIMITS
from iveg.domain.observations import CommandAnswer, Instant, Origin, SafetyReport
from iveg.domain.stop.attempt import Attempt, drives
from iveg.domain.stop.commands import PLAIN, Command, Kind, Press, State, Times
from iveg.domain.stop.effects import (
    Changed,
    Closed,
    Effect,
    Event,
    Key,
    OffTable,
    SendOnce,
    SendStop,
    SetDesiredState,
)
from iveg.domain.stop.evidence import Evidence, stands
from iveg.domain.stop.sends import Progress, Sends
from iveg.domain.stop.standstill import Standstill
from iveg.domain.stop.wanted import DesiredRecord
from iveg.domain.transports import TRANSPORTS, Transport, TransportId

_UNKNOWN = Origin()


class StopMachine(Evidence):
    """What iVeg wants of one robot, and how far that has come.

    Everything that can happen to it is a method; each returns what the world is asked
    to do, in this order.

    Attributes:
        stop: The STOP of this episode, as it is now.
        attempt: The release or resume under way.

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
        super().__init__()
        self.robot_id = robot_id
        self.state: State = "RUNNING"
        self.stop: Command | None = None
        self.attempt: Attempt | None = None
        self._transports = {one.id: one for one in transports}
        self._steps = STEPS if steps is None else steps
        self._sends = Sends(self._transports.values())
        self._standstill = Standstill()
        self._begun_at = self._joined_at = -inf
        self._deadline = 0.0
        self._doubt: str | None = None
        """The challenge of a release that may still lift the hold that is kept."""
        self._is_lost = False
        """An event had no row in the state that still is."""

    @property
    def wants_stop(self) -> bool:
        """Whether a STOP stands that no reported release has ended."""
        return self.stop is not None and self.state not in ("RUNNING", "READY")

    def follows(self, command: Command) -> bool:
        """Whether this is the STOP that stands now."""
        return self.wants_stop and _is(self.stop, command.command_id)

    @property
    def once(self) -> Command | None:
        """The release or resume under way, as people follow it."""
        return None if self.attempt is None else self.attempt.command

    @property
    def hold_id(self) -> str | None:
        """Our hold of this episode."""
        return None if self.stop is None else self.stop.hold_id

    # --- people -------------------------------------------------------------------

    def press(
        self, by: str, at: Instant, new_id: str, *, press: Press = PLAIN
    ) -> list[Effect]:
        """STOP: always accepted; a press during an episode joins it."""
        if not self.wants_stop or self.state == "RELEASING":
            return self._stop_again("requested", at, new_id, by, press)
        self._joined_at = at.mono
        effects = [] if self.state == "STANDING" else self._send_now(at)
        if self.stop is None or by in self.stop.requesters:
            return effects
        # One more person wants it: nothing changes but the audit.
        self.stop = replace(self.stop, requesters=(*self.stop.requesters, by))
        return [*effects, self._changed("requested", self.stop, f"joined by {by}")]

    def restore(self, wanted: DesiredRecord, at: Instant, new_id: str) -> list[Effect]:
        """STOP once more what an earlier run had stopped.

        A hold that no release ever named cannot have been lifted, so asserting it again
        adds none.  One that was named may have been: the robot would answer RELEASED
        and hold nothing, so the hold is a new one; unless there are so many that theirs
        is asserted until the robot's word, or its silence, decides.
        """
        kept, doubt = wanted.hold_id, None
        if kept is not None and kept in wanted.named:
            many = len(wanted.asked) >= LIMITS.most_holds
            kept, doubt = (kept, wanted.challenge) if many else (None, None)
        event = Event("reasserted", at, new_id, wanted.by, kept=kept, doubt=doubt)
        return self._take(event)

    def drill(self, by: str, at: Instant, new_id: str, press: Press) -> list[Effect]:
        """Press STOP to prove that it works, on a robot that hardly moves.

        Raises:
            CommandRefusedError: stopped already, faster than a crawl, or unheard.
        """
        self.guard_drill(self.robot_id, self.state, at)
        return self._take(Event("requested", at, new_id, by, press))

    def release(
        self, by: str, seen: Iterable[str], at: Instant, new_id: str
    ) -> list[Effect]:
        """Lift exactly the holds that a person saw.

        Raises:
            CommandRefusedError: not standing, no fresh report, the set has changed, or
                somebody has just joined the STOP.
        """
        if at.mono - self._joined_at < LIMITS.joined_unseen_s:
            why = "somebody has pressed STOP just now"
            raise CommandRefusedError(self.robot_id, "Release", why)
        report, remote = self.guard_release(self.robot_id, self.state, at, seen)
        return self._order("release", by, at, new_id, report.challenge, remote)

    def resume(self, by: str, at: Instant, new_id: str) -> list[Effect]:
        """Let a released robot drive.

        Raises:
            CommandRefusedError: still held, not standing, or no fresh report.
        """
        report = self.guard_resume(self.robot_id, self.state, at)
        return self._order("resume", by, at, new_id, report.challenge, ())

    def _order(
        self,
        kind: Kind,
        by: str,
        at: Instant,
        new_id: str,
        challenge: str | None,
        ids: tuple[str, ...],
    ) -> list[Effect]:
        command = replace(self._command(kind, new_id, Times(at), by), tries=1)
        # Refused, a robot that iVeg has not stopped is what it was before: running.
        before: State = "RUNNING" if self.stop is None else self.state
        attempt = Attempt(command, challenge or "", ids, before)
        key: Key = "releasing" if kind == "release" else "resuming"
        return self._take(Event(key, at, new_id, by, attempt=attempt))

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

        Args:
            transport: Which.
            command_id: What was sent.
            at: This moment.
            ok: Whether it was taken.
            doubtful: It is known that what lies behind does not pass anything on.
            left: When it was handed to the transport; this moment unless told.
        """
        way = self._transports[transport]
        if self.stop is not None and _is(self.stop, command_id):
            self._sends.came_back(transport, at)
            self.stop = self.stop.sent(way, left or at, ok=ok, doubtful=doubtful)
        elif self.attempt is not None and _is(self.once, command_id):
            command = self.attempt.command.sent(
                way, left or at, ok=ok, doubtful=doubtful
            )
            self.attempt = replace(self.attempt, command=command)
        else:
            return []  # Its episode has ended meanwhile.
        if not ok or doubtful or self.state != "REQUESTED":
            return []
        return self._take(Event("sent", at))

    def note_lag(self, lag_s: float | None) -> None:
        """How far the agent is behind while an order is being sent (s)."""
        if self.attempt is not None:
            command = replace(self.attempt.command, agent_lag_s=lag_s)
            self.attempt = replace(self.attempt, command=command)
        elif self.stop is not None:
            self.stop = replace(self.stop, agent_lag_s=lag_s)

    # --- the robot ----------------------------------------------------------------

    def answered(
        self, answer: CommandAnswer, at: Instant, transport: TransportId, new_id: str
    ) -> list[Effect]:
        """The robot's own answer on ``cmdexe`` or ``cmd_info``."""
        is_news = self.is_news(answer.origin)
        if self.attempt is not None:
            # Without an attempt, the copy of a refusal that came is none of this.
            unnamed = answer.attempt is None and answer.result == "REFUSED"
            if (unnamed and not is_news) or not self.attempt.is_meant_by(answer):
                return []
            self.attempt = self.attempt.answered(answer, transport, at)
            # Its report may have come before the answer.
            ended = self.attempt.is_refused(self.report, self.hold_id)
            refused = answer.result == "REFUSED" and ended
            return self._take(Event("refused", at)) if refused else []
        if self.wants_stop and answer.result == "RELEASED":
            # It will never hold by that name again: only a new one can.
            return self._lifted(at, new_id) if answer.id == self.hold_id else []
        if self.stop is None or answer.result != "LATCHED":
            return []
        if self.hold_id not in {answer.id, *(hold.id for hold in answer.holds)}:
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
        """The robot's safety report, new by (boot, seq), ``age_s`` old at most.

        ``sparse``: it came on a topic that has two of them a second, not ten.
        """
        self.take(report, at, age_s)
        if self.state == "READY" and drives(report):
            return self._take(Event("running", at))
        if self.state in ("RUNNING", "READY"):
            # A hold of iVeg that this process did not ask for is never dropped.
            ours = self.ours[-1:]
            return self._take(Event("adopted", at, ours[0])) if ours else []
        if self.attempt is not None:
            verdict = self.attempt.verdict(report, self.hold_id)
            return [] if verdict is None else self._take(Event(verdict, at))
        return self._reported_stopped(report, at, transport, new_id, sparse=sparse)

    def _reported_stopped(
        self,
        report: SafetyReport,
        at: Instant,
        transport: TransportId,
        new_id: str,
        *,
        sparse: bool,
    ) -> list[Effect]:
        assert self.stop is not None  # noqa: S101 - every such state has an episode
        stood = self.state in ("STANDING", "STALE")
        if self.hold_id not in {hold.id for hold in report.holds}:
            self._standstill.forget()
            lifted = stood or self.hold_id in report.released
            return self._lifted(at, new_id) if lifted else []
        if report.challenge != self._doubt:
            self._doubt = None
        self.stop = self.stop.heard_of(transport, at)
        effects = self._delivered(at)
        if not stands(report):
            self._standstill.forget()
            moved = self._stop_again("moved", at, new_id) if stood else []
            return [*effects, *moved]
        # Five samples at rest over a second are a standstill.
        measured = self._standstill.rested(at, report.origin, sparse=sparse)
        if not measured or self.state == "STANDING":
            return effects
        if self.evidence_age(at) > LIMITS.report_stale_s:
            return effects  # it stood; nobody knows whether it stands
        return [*effects, *self._take(Event("standing", at))]

    def odometry(
        self,
        linear: float,
        angular: float,
        at: Instant,
        new_id: str,
        origin: Origin = _UNKNOWN,
        age_s: float = inf,
    ) -> list[Effect]:
        """A speed, proven to be no older than ``age_s``.

        Three moving ones in a row, measured later, contradict a standstill.
        """
        moves = max(abs(linear), abs(angular)) >= LIMITS.standing_speed
        contradicted = self._standstill.odometry(at, origin, age_s, moves=moves)
        if contradicted is None:
            return []
        self.speed = abs(linear)
        if self.state == "STANDING" and contradicted:
            return self._stop_again("moved", at, new_id)
        return []

    def _delivered(self, at: Instant) -> list[Effect]:
        if self.state not in ("REQUESTED", "SENT", "UNCONFIRMED"):
            return []
        return self._take(Event("delivered", at))

    def _lifted(self, at: Instant, new_id: str) -> list[Effect]:
        """The hold is lost without a release."""
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
            return self._take(Event("release_unconfirmed", now, new_id))
        match self.state:
            case "REQUESTED" | "SENT" if late:
                return self._take(Event("unconfirmed", now))
            case "DELIVERED" if late:
                return self._take(Event("still_moving", now))
            case "STANDING" if self.evidence_age(now) > LIMITS.report_stale_s:
                return self._take(Event("stale", now))
            case "RELEASING" if late and self.attempt is not None:
                return self._unconfirmed(self.attempt, now, new_id)
        return []

    def _is_doubtful(self, now: Instant) -> bool:
        """Whether a hold that may have been lifted goes unreported for too long."""
        if self._doubt is None or not self.wants_stop or self.state == "RELEASING":
            return False
        heard_at = -inf if self.report_at is None else self.report_at.mono
        return now.mono - max(heard_at, self._begun_at) > LIMITS.report_fresh_s

    def _unconfirmed(self, attempt: Attempt, at: Instant, new_id: str) -> list[Effect]:
        """Nothing decided it in time: it becomes a STOP (I7).

        One that holds on to what the robot holds, where that is certain.
        """
        if attempt.is_spent(self.report) and self.ours:
            kept = self._kept()
            return self._take(Event("release_unconfirmed", at, new_id, kept=kept))
        return self._stop_again("release_unconfirmed", at, new_id)

    def _stop_again(
        self, key: Key, at: Instant, new_id: str, by: str = "iveg", press: Press = PLAIN
    ) -> list[Effect]:
        """A new episode of a robot that may be held already.

        Its hold is new, too, unless the robot has just reported so many that one more
        would only make a pile; then one of those is held on to.
        """
        is_fresh = self.report_age(at) <= LIMITS.report_fresh_s
        many = len(self.ours) >= LIMITS.most_holds and is_fresh
        doubt = self._doubt
        if self.attempt is not None:
            spent = self.attempt.is_spent(self.report)
            doubt = None if spent else self.attempt.challenge
        kept = self._kept() if many else None
        return self._take(Event(key, at, new_id, by, press, kept, doubt))

    def _kept(self) -> str:
        """A hold of iVeg's that the robot last reported: ours, or else the newest."""
        hold_id = self.hold_id
        return hold_id if hold_id in self.ours and hold_id else self.ours[-1]

    # --- a step -------------------------------------------------------------------

    def _take(self, event: Event) -> list[Effect]:
        """Take the step of the table, or report that there is none."""
        step = self._steps.get((self.state, event.key))
        self._is_lost = step is None
        if step is None:
            return [OffTable(self.robot_id, self.state, event.key)]
        attempt = self.attempt
        before: State = "RUNNING" if attempt is None else attempt.before
        self.state = before if step.to is None else step.to
        effects = step.do(self, event)
        if self.stop is not None:
            self.stop = replace(self.stop, state=self.state)
        if self.attempt is not None:
            command = replace(self.attempt.command, state=self.state)
            self.attempt = replace(self.attempt, command=command)
        why = attempt.refused if attempt and event.key == "refused" else None
        changed = self._changed(event.key, self.once or self.stop, why)
        if step.ends != "nothing":
            self.attempt = None
        if step.ends == "all":
            self.stop = None
        return [*effects, changed]

    def _changed(self, key: Key, about: Command | None, why: str | None) -> Changed:
        commands = tuple(one for one in (self.stop, self.once) if one is not None)
        command_id = "" if about is None else about.command_id
        return Changed(self.robot_id, command_id, self.state, key, why, commands)

    def _command(self, kind: Kind, name: str, times: Times, by: str) -> Command:
        """A command that begins; ``off`` on the transports that do not carry it."""
        state: State = "REQUESTED" if kind == "stop" else "RELEASING"
        ways = dict.fromkeys(self._transports, "pending")
        ways |= dict.fromkeys(ways.keys() - set(self._carriers(kind)), "off")
        return Command(name, self.robot_id, kind, state, times, (by,), transports=ways)

    def _carriers(self, kind: Kind) -> tuple[TransportId, ...]:
        return tuple(
            one.id
            for one in self._transports.values()
            if (one.can_stop if kind == "stop" else one.can_release)
        )

    # --- what the steps do --------------------------------------------------------

    def _begin(self, event: Event) -> list[Effect]:
        """A new episode, under an id that was never used before."""
        closed = self._close(event.key)
        times = Times.of(event.at, event.press)
        self.stop = replace(
            self._command("stop", event.new_id, times, event.by),
            drill=event.press.drill,
            held_as=event.kept,
            reason=None if event.key == "requested" else event.key,
        )
        self.attempt, self._begun_at = None, event.at.mono
        self._doubt = None if event.kept is None else event.doubt
        self._standstill.forget()
        self._deadline = event.at.mono + LIMITS.unconfirmed_after_s
        self._sends.begin()
        level = SetDesiredState(self.robot_id, "stopped", (event.kept or event.new_id,))
        return [*self._send_now(event.at), level, *closed]

    def _adopt(self, event: Event) -> list[Effect]:
        """A hold of iVeg that this process did not ask for is taken over."""
        closed = self._close(event.key)
        self.stop = self._command("stop", event.new_id, Times(event.at), event.by)
        self._doubt = None
        self._standstill.forget()
        self._sends.begin()
        self._sends.now(event.at)
        self._deadline = event.at.mono + LIMITS.braking_most_s
        return [SetDesiredState(self.robot_id, "stopped", (event.new_id,)), *closed]

    def _close(self, key: Key) -> list[Closed]:
        """What is followed no more says so in its own row."""
        closed = []
        if self.once is not None:
            late = key == "release_unconfirmed"
            ended = replace(
                self.once, state="EXPIRED" if late else "REPLACED", reason=key
            )
            closed.append(Closed(self.robot_id, ended, key))
        if self.stop is not None:
            ended = replace(self.stop, state="REPLACED")
            closed.append(Closed(self.robot_id, ended, key))
        return closed

    def _allow_braking(self, event: Event) -> list[Effect]:
        braking = self.speed / LIMITS.least_braking_m_s2 + LIMITS.braking_extra_s
        # From the robot's word on: before it, a robot out of reach could not brake.
        self._deadline = event.at.mono + min(braking, LIMITS.braking_most_s)
        return []

    def _note_standstill(self, event: Event) -> list[Effect]:
        if self.stop is not None:
            self.stop = self.stop.stood(self._standstill.since or event.at)
        return []

    def _ask_at_once(self, event: Event) -> list[Effect]:
        self._standstill.forget()
        self._sends.repeat_now(event.at)
        return []

    def _send_once(self, event: Event) -> list[Effect]:
        attempt = self.attempt = event.attempt
        assert attempt is not None  # noqa: S101 - whoever orders makes one
        self._deadline = event.at.mono + LIMITS.release_within_s
        kind: Literal["release", "resume"] = (
            "release" if attempt.command.kind == "release" else "resume"
        )
        sending = SendOnce(
            self.robot_id,
            attempt.command.command_id,
            kind,
            attempt.challenge,
            self._carriers(kind),
            attempt.ids,
            tuple(one for one in self.ours if one in attempt.ids),
        )
        return [sending]

    def _say_why(self, _: Event) -> list[Effect]:
        if self.attempt is not None:
            command = replace(self.attempt.command, reason=self.attempt.refused)
            self.attempt = replace(self.attempt, command=command)
        return []

    def _let_go(self, _: Event) -> list[Effect]:
        return [SetDesiredState(self.robot_id, "run", ())]

    def _nothing(self, _: Event) -> list[Effect]:
        return []

    # --- sends --------------------------------------------------------------------

    def _send_now(self, at: Instant) -> list[Effect]:
        """On all transports at once, whatever was due when."""
        self._sends.now(at)
        return self._send_due(at)

    def _send_due(self, at: Instant) -> list[Effect]:
        """On the transports that are due."""
        stop = self.stop
        assert stop is not None  # noqa: S101 - callers have begun an episode
        age_s = at.mono - stop.times.requested.mono
        due = self._sends.due(at, age_s, self._progress())
        if due and self.state != "STANDING":
            self.stop = replace(stop, tries=stop.tries + 1)
        hold_id = stop.hold_id or stop.command_id
        return [SendStop(self.robot_id, hold_id, one, stop.command_id) for one in due]

    def _progress(self) -> Progress:
        """What the robot has said of the STOP that stands."""
        if self.state == "STANDING":
            return "standing"
        return "delivered" if self.state in ("DELIVERED", "STILL_MOVING") else "asked"


def _is(command: Command | None, command_id: str) -> bool:
    return command is not None and command.command_id == command_id


@dataclass(frozen=True, slots=True)
class Step:
    """What follows an event.

    Attributes:
        to: The new state; None is the one that the attempt began in.
        do: What changes, and what the world is asked to do besides telling of it.
        ends: What is over once that was told: nothing, the release or resume, or all.
    """

    to: State | None
    do: Callable[[StopMachine, Event], list[Effect]]
    ends: Literal["nothing", "order", "all"] = "nothing"


def _steps() -> Iterable[tuple[Key, tuple[State, ...], Step]]:
    """One row an event: from which states, and what follows."""
    m = StopMachine
    every = get_args(State)
    stop = Step("REQUESTED", m._begin)
    yield "requested", every, stop
    yield "reasserted", every, stop
    yield "moved", every, stop
    yield "release_unconfirmed", every, stop
    yield "sent", ("REQUESTED",), Step("SENT", m._nothing)
    asked: tuple[State, ...] = ("REQUESTED", "SENT", "UNCONFIRMED")
    yield "delivered", asked, Step("DELIVERED", m._allow_braking)
    yield "unconfirmed", asked[:2], Step("UNCONFIRMED", m._nothing)
    yield "still_moving", ("DELIVERED",), Step("STILL_MOVING", m._nothing)
    moving: tuple[State, ...] = ("DELIVERED", "STILL_MOVING", "STALE")
    yield "standing", moving, Step("STANDING", m._note_standstill)
    yield "stale", ("STANDING",), Step("STALE", m._ask_at_once)
    order = Step("RELEASING", m._send_once)
    yield "releasing", ("STANDING", "RUNNING"), order
    yield "resuming", ("READY", "RUNNING"), order
    yield "refused", ("RELEASING",), Step(None, m._say_why, "order")
    yield "ready", ("RELEASING",), Step("READY", m._let_go, "order")
    yield "running", ("RELEASING", "READY"), Step("RUNNING", m._nothing, "all")
    yield "adopted", ("RUNNING", "READY"), Step("DELIVERED", m._adopt)


STEPS: Mapping[tuple[State, Key], Step] = {
    (state, key): step for key, states, step in _steps() for state in states
}
