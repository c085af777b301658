"""Orders to one robot and what is kept of its STOP, before the table decides.

In this order: the desired state on disk (I1), an attempt to release or resume (I2, I6),
events and effects of the machine, the timetable of repetitions (I4), and the state that
``machine.StopMachine`` changes.

An order carries a challenge that the robot spends on the first copy, whatever it makes
of it.  So a newer report with another challenge says that no copy can act any more:
what it shows has come to stay.  The copies go out once on each transport and come in
any order, late, or not at all.  The robot's reports decide, not its answers: one that
shows the release makes it true, and a refusal counts once a report shows that the
challenge is spent.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Literal

from iveg.domain.limits import LIMITS
from iveg.domain.observations import CommandAnswer, Instant, SafetyReport
from iveg.domain.stop.commands import (
    PLAIN,
    CommandState,
    FollowedCommand,
    Kind,
    Press,
    State,
    Times,
    believe,
)
from iveg.domain.stop.standstill import StopEvidence
from iveg.domain.transports import Transport, TransportId


@dataclass(frozen=True, slots=True)
class Kept:
    """An existing hold of the robot that a new STOP asserts again.

    Attributes:
        hold_id: None: the STOP is a new hold.
        challenge: Of a release that may still lift it.
    """

    hold_id: str | None = None
    challenge: str | None = None


NEW_HOLD = Kept()


@dataclass(frozen=True, slots=True)
class DesiredRecord:
    """The stored desire that a robot stands.

    Attributes:
        by: The person who asked.
        hold_id: The hold of that STOP; None where the disk does not know whether a
            release has named it.
        named: Holds that any release ever named, the last 64, newest last.
        asked: STOPs that the newest release named, if nothing has confirmed it.
        challenge: The challenge which that release carried.
    """

    by: str
    hold_id: str | None = None
    named: tuple[str, ...] = ()
    asked: tuple[str, ...] = ()
    challenge: str | None = None

    def hold_to_assert(self) -> Kept:
        """The hold that a STOP after a restart asserts again.

        A hold that no release ever named cannot have been lifted, so asserting it again
        adds none.  One that was named may have been: the robot would answer RELEASED
        and hold nothing, so the hold is a new one; unless there are so many that
        theirs is asserted until the robot's word, or its silence, decides.
        """
        if self.hold_id in self.named:
            many = len(self.asked) >= LIMITS.most_holds
            return Kept(self.hold_id, self.challenge) if many else NEW_HOLD
        return Kept(self.hold_id)


@dataclass(frozen=True, slots=True)
class Attempt:
    """A release or resume that was sent and not yet decided.

    Attributes:
        challenge: That of the report that a person saw.
        ids: What a release lifts; none in a resume.
        before: The state that it began in, and goes back to if it is refused.
        refused: Why one of its copies was refused.
    """

    command: FollowedCommand
    challenge: str
    ids: tuple[str, ...] = ()
    before: State = "STANDING"
    refused: str | None = None

    def is_spent(self, report: SafetyReport | None) -> bool:
        """Whether no copy can act any more.

        Args:
            report: The robot's newest, by (boot, seq): not older than the one that the
                order was made from.
        """
        return report is not None and report.challenge != self.challenge

    def answered(
        self, answer: CommandAnswer, transport: TransportId, at: Instant
    ) -> "Attempt":
        """The robot answers a copy."""
        command = self.command.answered(transport, at)
        refused = self.refused
        if answer.result == "REFUSED":
            refused = answer.why or "refused"
        return replace(self, command=command, refused=refused)

    def verdict(
        self, report: SafetyReport, hold_id: str | None
    ) -> Literal["running", "ready", "refused"] | None:
        """Decision of a report on it; None where it decides nothing.

        Args:
            report: The robot's newest.
            hold_id: Our hold; None where iVeg has not stopped the robot.
        """
        if self.command.kind == "resume" and drives(report):
            return "running"
        is_named = hold_id is None or hold_id in report.released
        if (
            self.command.kind == "release"
            and is_named
            and not _is_held(report, hold_id)
        ):
            return "ready"
        return "refused" if self.is_refused(report, hold_id) else None

    def is_refused(self, report: SafetyReport | None, hold_id: str | None) -> bool:
        """Whether one copy was refused and none can act any more; args likewise."""
        if self.refused is None or not self.is_spent(report):
            return False
        is_resume = self.command.kind == "resume"
        return is_resume or (report is not None and _is_held(report, hold_id))


def drives(report: SafetyReport) -> bool:
    """Whether a robot reports that it is free to drive."""
    return not report.holds and report.speed_factor > 0


def _is_held(report: SafetyReport, hold_id: str | None) -> bool:
    """Whether our hold stands, or any that iVeg may lift where it has none."""
    if hold_id is None:
        return any(hold.ack == "remote" for hold in report.holds)
    return hold_id in {hold.id for hold in report.holds}


Key = Literal[
    "requested",
    "reasserted",
    "moved",
    "release_unconfirmed",
    "adopted",
    "sent",
    "delivered",
    "standing",
    "unconfirmed",
    "still_moving",
    "stale",
    "releasing",
    "resuming",
    "refused",
    "ready",
    "running",
]
"""Kinds of events; also names of their log sentences."""
_ORDERS: Mapping[Key, Kind] = {"releasing": "release", "resuming": "resume"}


@dataclass(frozen=True, slots=True)
class Event:
    """An event, with the arguments of its step.

    Attributes:
        new_id: Names the command that begins, and its hold unless one is ``kept``.
        by: The person who wants it.
        press: The page's account of a press.
        kept: The hold that a STOP holds on to.
        attempt: The release or resume that begins.
    """

    key: Key
    at: Instant
    new_id: str = ""
    by: str = "iveg"
    press: Press = PLAIN
    kept: Kept = NEW_HOLD
    attempt: Attempt | None = None

    def begins(self, robot_id: str, transports: Iterable[Transport]) -> FollowedCommand:
        """The command that begins with it; ``off`` on transports that cannot carry it.

        A release or resume is sent once, at once; a STOP as often as it takes.
        """
        kind = _ORDERS.get(self.key, "stop")
        is_stop = kind == "stop"
        plain = not is_stop or self.key in ("requested", "adopted")
        ways = {
            transport.id: "pending" if transport.carries(kind) else "off"
            for transport in transports
        }
        return FollowedCommand(
            self.new_id,
            robot_id,
            kind,
            "REQUESTED" if is_stop else "RELEASING",
            Times(self.at, believe(self.press.pressed_at, self.at)),
            requesters=(self.by,),
            tries=0 if is_stop else 1,
            reason=None if plain else self.key,
            transports=ways,
            held_as=self.kept.hold_id,
        )


@dataclass(frozen=True, slots=True)
class SendStop:
    """Send this hold on this transport, now, for this command."""

    robot_id: str
    hold_id: str
    transport: TransportId
    command_id: str


@dataclass(frozen=True, slots=True)
class SendOnce:
    """Send a release or a resume, once on each transport.

    Attributes:
        ours: Those of its holds that are STOPs of iVeg.
    """

    attempt: Attempt
    ours: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SetDesiredState:
    """Publish the retained desired state that a reconnecting robot finds."""

    robot_id: str
    desired: Literal["stopped", "run"]
    ids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Changed:
    """The state changed: one audit row, one log line.

    Attributes:
        command_id: Whose step it is.
        key: Names the sentence, such as ``standing`` or ``moved``.
        commands: The STOP and the order under way, as they are after it.
    """

    command_id: str
    state: CommandState
    key: Key
    why: str | None = None
    commands: tuple[FollowedCommand, ...] = ()


@dataclass(frozen=True, slots=True)
class Closed:
    """A command that is no longer followed: its last audit row, and no log line.

    Attributes:
        key: What closed it; its sentence stands at the command that came.
    """

    command: FollowedCommand
    key: Key


@dataclass(frozen=True, slots=True)
class OffTable:
    """An event without a row in this state: a mistake in the machine.

    Nothing has changed, and the desired state stays.
    """

    robot_id: str
    state: State
    key: Key


Effect = SendStop | SendOnce | SetDesiredState | Changed | Closed | OffTable


FIWARE_PAUSE_S = 2.0
STANDING_RESEND_S = 5.0
_PAUSE_S: Mapping[str, float] = {
    "DELIVERED": 1.0,
    "STILL_MOVING": 1.0,
    "STANDING": STANDING_RESEND_S,
}
"""Between two sends to a robot that has it; to every other ``_pause`` by its age."""
_EARLY_S = 1e-3
"""Clocks that tick in fractions meet a planned moment only nearly."""


class Sends:
    """Timetable of one robot's STOP.

    A transport that takes any number: at 0, 250, 500 and 1000 ms, then every half
    second, after ten seconds every second; to a robot that has it every second, to a
    standing one every five.  One that takes one at a time (Orion): the next two seconds
    after the last came back, and none to a robot that has it, unless there is no other
    transport.
    """

    def __init__(self, transports: Iterable[Transport]) -> None:
        self._ways = {way.id: way for way in transports if way.can_stop}
        self._is_alone = all(way.one_at_a_time for way in self._ways.values())
        self._sent: dict[TransportId, tuple[float, float]] = {}
        """When a STOP was last sent (monotonic, s), and how old it was then (s)."""
        self._busy: set[TransportId] = set()
        """Transports of one at a time with a request under way."""
        self._next: dict[TransportId, float] = {}
        """When those may be asked again (monotonic, s)."""

    def begin(self, at: Instant) -> None:
        """A new episode, on all at once; what is under way is of an earlier one."""
        self._busy.clear()
        self.now(at)

    def now(self, at: Instant) -> None:
        """Make every transport due now."""
        self._sent.clear()
        self._next = dict.fromkeys(self._ways, at.mono)

    def repeat_now(self) -> None:
        """Make those that take any number due at the next check."""
        self._sent.clear()

    def came_back(self, transport: TransportId, at: Instant) -> None:
        """Note that a transport's request has ended."""
        self._busy.discard(transport)
        self._next[transport] = at.mono + FIWARE_PAUSE_S

    def due(self, stop: FollowedCommand, at: Instant) -> list[SendStop]:
        """Sends that are due now; they count as sent."""
        hold_id = stop.hold_id or stop.command_id
        sends = []
        for way in self._ways.values():
            is_due = self._is_free if way.one_at_a_time else self._is_due
            if is_due(way.id, stop, at):
                send = SendStop(stop.robot_id, hold_id, way.id, stop.command_id)
                sends.append(send)
        return sends

    def _is_due(self, way: TransportId, stop: FollowedCommand, at: Instant) -> bool:
        """Whether to repeat it on a transport that takes any number."""
        sent_at, age_then = self._sent.get(way, (-inf, 0.0))
        pause_s = _PAUSE_S.get(stop.state, _pause(age_then))
        if at.mono - sent_at < pause_s - _EARLY_S:
            return False
        self._sent[way] = at.mono, at.mono - stop.times.requested.mono
        return True

    def _is_free(self, way: TransportId, stop: FollowedCommand, at: Instant) -> bool:
        """Whether to ask a transport that takes one at a time."""
        if way in self._busy or (stop.state in _PAUSE_S and not self._is_alone):
            return False
        stands = stop.state == "STANDING"
        rest_s = STANDING_RESEND_S - FIWARE_PAUSE_S if stands else 0.0
        if at.mono < self._next.get(way, 0.0) + rest_s:
            return False
        self._busy.add(way)
        return True


def _pause(age_s: float) -> float:
    """Pause after a send at this age of a STOP that the robot does not have (s)."""
    if age_s < 0.5 - _EARLY_S:
        return 0.25
    return 0.5 if age_s < 10.0 else 1.0


class StopStatus:
    """The state of one robot's STOP.

    Attributes:
        stop: The STOP of this episode, as it is now.
        attempt: The release or resume under way.
        evidence: What the robot itself reports.
    """

    def __init__(self, robot_id: str, transports: Iterable[Transport]) -> None:
        self.robot_id = robot_id
        self.state: State = "RUNNING"
        self.stop: FollowedCommand | None = None
        self.attempt: Attempt | None = None
        self.evidence = StopEvidence(robot_id)
        self._transports = {way.id: way for way in transports}
        self._sends = Sends(self._transports.values())
        self._joined_at = self._begun_at = -inf
        self._deadline = 0.0
        self._doubt: str | None = None
        """The challenge of a release that may still lift the hold that is kept."""
        self._is_lost = False
        """An event had no row in the state that still is."""

    @property
    def wants_stop(self) -> bool:
        """Whether a STOP stands that no reported release has ended."""
        return self.stop is not None and self.state not in ("RUNNING", "READY")

    def follows(self, command: FollowedCommand) -> bool:
        """Whether this is the STOP that stands now."""
        stop = self.stop if self.wants_stop else None
        return stop is not None and stop.command_id == command.command_id

    @property
    def once(self) -> FollowedCommand | None:
        """The release or resume under way."""
        return None if self.attempt is None else self.attempt.command

    @property
    def commands(self) -> tuple[FollowedCommand, ...]:
        """The STOP, and the release or resume under way, as they are now."""
        return tuple(
            command for command in (self.stop, self.once) if command is not None
        )

    def _find(self, command_id: str) -> FollowedCommand | None:
        found = (
            command for command in self.commands if command.command_id == command_id
        )
        return next(found, None)

    def _keep(self, command: FollowedCommand) -> None:
        """Store the new value of one of the two commands."""
        if command.kind == "stop":
            self.stop = command
        elif self.attempt is not None:
            self.attempt = replace(self.attempt, command=command)

    @property
    def hold_id(self) -> str | None:
        """Our hold of this episode."""
        return None if self.stop is None else self.stop.hold_id

    def _hold_to_keep(self, at: Instant, *, expired: bool) -> Kept:
        """The hold of iVeg, reported by the robot, that the next STOP holds on to.

        As a rule none: its hold is new.  But the robot may have just reported so many
        that one more would only make a pile; or a release has ``expired`` and nothing
        can lift any more what was reported after it.
        """
        evidence, attempt = self.evidence, self.attempt
        is_fresh = evidence.report_age(at) <= LIMITS.report_fresh_s
        many = is_fresh and len(evidence.ours) >= LIMITS.most_holds
        is_spent = attempt is not None and attempt.is_spent(evidence.report)
        ours = evidence.ours if many or (expired and is_spent) else []
        if not ours:
            return NEW_HOLD
        doubt = self._doubt if attempt is None else attempt.challenge
        kept = self.hold_id if self.hold_id in ours else ours[-1]
        return Kept(kept, None if is_spent else doubt)

    def _is_doubtful(self, now: Instant) -> bool:
        """Whether a hold that may have been lifted goes unreported for too long."""
        if self._doubt is None or not self.wants_stop or self.state == "RELEASING":
            return False
        since_report = self.evidence.report_age(now)
        return min(since_report, now.mono - self._begun_at) > LIMITS.report_fresh_s

    # --- what is recorded of it ---------------------------------------------------

    def _changed(
        self, key: Key, about: FollowedCommand | None, why: str | None
    ) -> Changed:
        command_id = "" if about is None else about.command_id
        return Changed(command_id, self.state, key, why, self.commands)

    def _closed_by(self, key: Key) -> list[Closed]:
        """Effects that close the commands of the ended episode."""
        return [Closed(command.ended(key), key) for command in reversed(self.commands)]
