"""Orders to one robot and the state of its STOP, before the table decides.

In this order: the desired state on disk (I1), an attempt to release or resume (I2, I6),
events and effects of the machine, the timetable of repetitions (I4), and the state that
``machine.StopMachine`` changes.

A RELEASE or RESUME carries a challenge.  The robot spends it on the first copy, whether
it obeys or refuses.  So a newer report with another challenge proves that no copy can
act any more.  One copy goes out on each transport; they arrive in any order, late, or
not at all.  The robot's reports decide, not its answers.  A report that shows the
release confirms it; a refusal counts once a report shows that the challenge is spent.

A robot takes no released id again, and gets no more holds than it may have.  So the
hold that the next STOP asserts depends on the release that names it::

    release                holds reported    next STOP           after a restart
    none                   not the most      a new hold          the same hold
    none                   the most          a reported hold     the same hold
    may still act          not the most      a new hold          a new hold
    may still act          the most          a reported hold *   the same hold *
    expired and spent      any               a reported hold     unknown: as above

    *  with the challenge: until a report shows another, or none comes for a second

A spent release that has not expired counts as none.
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
    """Existing hold of the robot that a new STOP asserts again.

    Attributes:
        hold_id: Its id; None: the STOP is a new hold.
        challenge: Challenge of a release that may still lift it; None: there is none.
    """

    hold_id: str | None = None
    challenge: str | None = None


NEW_HOLD = Kept()


@dataclass(frozen=True, slots=True)
class DesiredRecord:
    """Stored order that a robot stands.

    Attributes:
        by: The person who pressed STOP.
        hold_id: The hold of that STOP; None where the disk does not know whether a
            release has named it.
        named: The last 64 holds that any release named, newest last.
        open_release: STOPs that the newest release names, until it is confirmed.
        challenge: Challenge of that release.
    """

    by: str
    hold_id: str | None = None
    named: tuple[str, ...] = ()
    open_release: tuple[str, ...] = ()
    challenge: str | None = None

    def hold_to_assert(self) -> Kept:
        """The hold that a STOP after a restart asserts again.

        By the table in the module's head.  A hold that no release ever named cannot
        have been lifted: asserted again, it adds none.  For a named hold the robot may
        answer RELEASED and hold nothing.
        """
        if self.hold_id in self.named:
            is_full = len(self.open_release) >= LIMITS.most_holds
            return Kept(self.hold_id, self.challenge) if is_full else NEW_HOLD
        return Kept(self.hold_id)


@dataclass(frozen=True, slots=True)
class Attempt:
    """A release or resume that was sent and not yet decided.

    Attributes:
        command: The release or resume.
        challenge: Challenge of the report that a person saw.
        ids: Holds that a release lifts; none in a resume.
        before: State in which it began; a refusal leads back to it.
        refused: Reason of a copy's refusal; None: no copy was refused.
    """

    command: FollowedCommand
    challenge: str
    ids: tuple[str, ...] = ()
    before: State = "STANDING"
    refused: str | None = None

    def is_spent(self, report: SafetyReport | None) -> bool:
        """Whether no copy can act any more.

        ``report``: The robot's newest by (boot, seq), so at least as new as the one
        with the challenge.
        """
        return report is not None and report.challenge != self.challenge

    def answered(
        self, answer: CommandAnswer, transport: TransportId, at: Instant
    ) -> "Attempt":
        """Note the robot's answer to a copy."""
        is_refused = answer.result == "REFUSED"
        reason = (answer.why or "refused") if is_refused else self.refused
        command = self.command.answered(transport, at)
        return replace(self, command=command, refused=reason)

    def verdict(
        self, report: SafetyReport, hold_id: str | None
    ) -> Literal["running", "ready", "refused"] | None:
        """Verdict by the robot's newest report; None: the report decides nothing.

        ``hold_id``: Our hold; None where iVeg has not stopped the robot.
        """
        # A report that shows the effect confirms it, whichever copy acted.
        if self.command.kind == "resume" and may_drive(report):
            return "running"
        is_named = hold_id is None or hold_id in report.released
        if self.command.kind == "release" and is_named and not is_held(report, hold_id):
            return "ready"
        return "refused" if self.is_refused(report, hold_id) else None

    def is_refused(self, report: SafetyReport | None, hold_id: str | None) -> bool:
        """Whether a copy was refused and none can act any more; arguments as above."""
        if self.refused is None or not self.is_spent(report):
            return False
        # Another copy of a release may have succeeded: then it is no longer held.
        is_resume = self.command.kind == "resume"
        return is_resume or (report is not None and is_held(report, hold_id))


def may_drive(report: SafetyReport) -> bool:
    """Whether a robot reports that it is free to drive."""
    return not report.holds and report.speed_factor > 0


def is_held(report: SafetyReport, hold_id: str | None) -> bool:
    """Whether our hold is in force; without one, whether iVeg could lift any."""
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
        key: Kind of the event.
        at: Time of the event.
        new_id: Id of the command that begins; also of its hold, unless one is kept.
        by: The person who wants it.
        press: The page's account of a press.
        kept: Existing hold that the STOP asserts again.
        attempt: The release or resume that begins.
    """

    key: Key
    at: Instant
    new_id: str = ""
    by: str = "iveg"
    press: Press = PLAIN
    kept: Kept = NEW_HOLD
    attempt: Attempt | None = None

    def new_command(
        self, robot_id: str, transports: Iterable[Transport]
    ) -> FollowedCommand:
        """New command of the event; ``off`` on transports that cannot carry it.

        A release or resume is sent once; a STOP is repeated, and counts its tries.
        """
        kind = _ORDERS.get(self.key, "stop")
        is_stop = kind == "stop"
        # A press and an adoption explain themselves; any other cause is shown.
        is_plain = not is_stop or self.key in ("requested", "adopted")
        states = {
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
            reason=None if is_plain else self.key,
            transports=states,
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
        attempt: The release or resume.
        ours: Holds in it that are STOPs of iVeg.
    """

    attempt: Attempt
    ours: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SetDesiredState:
    """Publish the retained desired state, for a robot that connects again."""

    robot_id: str
    desired: Literal["stopped", "run"]
    ids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Changed:
    """The state changed: one audit row, one log line.

    Attributes:
        command_id: The command that the step belongs to.
        key: Key of the log sentence, such as ``standing`` or ``moved``.
        why: Reason of a refusal, or who joined.
        commands: The STOP and the order under way, after the step.
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
        key: Event that closed it; its sentence stands at the command that came.
    """

    command: FollowedCommand
    key: Key


@dataclass(frozen=True, slots=True)
class OffTable:
    """An event without a row in this state: a mistake in the machine.

    No state changes, and the desired state stays.
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
"""Pause between two sends to a robot that has the STOP, by state (s)."""
_EARLY_S = 1e-3
"""Tolerance of a planned moment, since clocks tick in fractions (s)."""


class Timetable:
    """Times at which the STOP of one robot is sent and repeated.

    A direct transport sends at 0, 250, 500 and 1000 ms, then every half second, after
    ten seconds every second.  To a robot that has the STOP it sends every second, to a
    standing robot every five.

    A serial transport (Orion) takes the next message two seconds after the last came
    back.  It sends none to a robot that has the STOP, unless all transports are serial.
    """

    def __init__(self, transports: Iterable[Transport]) -> None:
        self._transports = {
            transport.id: transport for transport in transports if transport.can_stop
        }
        self._all_serial = all(
            transport.is_serial for transport in self._transports.values()
        )
        self._sent: dict[TransportId, tuple[float, float]] = {}
        """Time of the last send (monotonic, s), and the STOP's age then (s)."""
        self._busy: set[TransportId] = set()
        """Serial transports with a request under way."""
        self._next: dict[TransportId, float] = {}
        """Earliest next request on a serial transport (monotonic, s)."""

    def begin(self, at: Instant) -> None:
        """Begin an episode on all transports at once."""
        # Requests under way belong to an earlier episode, so they hold up none.
        self._busy.clear()
        self.now(at)

    def now(self, at: Instant) -> None:
        """Make every transport due now."""
        self._sent.clear()
        self._next = dict.fromkeys(self._transports, at.mono)

    def repeat_now(self) -> None:
        """Make all but serial transports due at the next check."""
        self._sent.clear()

    def came_back(self, transport: TransportId, at: Instant) -> None:
        """Note that a request on this transport has ended."""
        self._busy.discard(transport)
        self._next[transport] = at.mono + FIWARE_PAUSE_S

    def due(self, stop: FollowedCommand, at: Instant) -> list[SendStop]:
        """Sends that are due now; they count as sent."""
        hold_id = stop.hold_id or stop.command_id
        return [
            SendStop(stop.robot_id, hold_id, transport.id, stop.command_id)
            for transport in self._transports.values()
            if self._is_due(transport, stop, at)
        ]

    def _is_due(self, transport: Transport, stop: FollowedCommand, at: Instant) -> bool:
        """Whether a transport is due; then it counts as sent."""
        if transport.is_serial:
            return self._is_serial_due(transport.id, stop, at)
        sent_at, age_then = self._sent.get(transport.id, (-inf, 0.0))
        pause_s = _PAUSE_S.get(stop.state, _pause(age_then))
        if at.mono - sent_at < pause_s - _EARLY_S:
            return False
        self._sent[transport.id] = at.mono, at.mono - stop.times.requested.mono
        return True

    def _is_serial_due(
        self, transport: TransportId, stop: FollowedCommand, at: Instant
    ) -> bool:
        """Whether a serial transport is due; then it counts as busy."""
        if transport in self._busy or (stop.state in _PAUSE_S and not self._all_serial):
            return False
        rest_s = STANDING_RESEND_S - FIWARE_PAUSE_S if stop.state == "STANDING" else 0.0
        if at.mono < self._next.get(transport, 0.0) + rest_s:
            return False
        self._busy.add(transport)
        return True


def _pause(age_s: float) -> float:
    """Pause after a send of a STOP of this age that the robot does not have (s)."""
    if age_s < 0.5 - _EARLY_S:
        return 0.25
    return 0.5 if age_s < 10.0 else 1.0


class StopStatus:
    """The state of one robot's STOP.

    Attributes:
        robot_id: The robot.
        state: Its state, as drawn in ``machine``.
        stop: The STOP of this episode; None: there is none.
        attempt: The release or resume under way; None: there is none.
        evidence: Reports and odometry of the robot.
    """

    def __init__(self, robot_id: str, transports: Iterable[Transport]) -> None:
        self.robot_id = robot_id
        self.state: State = "RUNNING"
        self.stop: FollowedCommand | None = None
        self.attempt: Attempt | None = None
        self.evidence = StopEvidence(robot_id)
        self._transports = {transport.id: transport for transport in transports}
        self._timetable = Timetable(self._transports.values())
        self._joined_at = self._begun_at = -inf
        self._deadline = 0.0
        self._open_challenge: str | None = None
        """Challenge of a release that may still lift the kept hold."""
        self._had_no_row = False
        """Whether the last event had no row in this state."""

    @property
    def wants_stop(self) -> bool:
        """Whether a STOP is in force that no reported release has ended."""
        return self.stop is not None and self.state not in ("RUNNING", "READY")

    def follows(self, command: FollowedCommand) -> bool:
        """Whether this command is the STOP in force."""
        is_same = self.stop is not None and self.stop.command_id == command.command_id
        return self.wants_stop and is_same

    @property
    def order(self) -> FollowedCommand | None:
        """The release or resume under way; None: there is none."""
        return None if self.attempt is None else self.attempt.command

    @property
    def commands(self) -> tuple[FollowedCommand, ...]:
        """The STOP, and the release or resume under way."""
        return tuple(
            command for command in (self.stop, self.order) if command is not None
        )

    def _find(self, command_id: str) -> FollowedCommand | None:
        return next(
            (command for command in self.commands if command.command_id == command_id),
            None,
        )

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
        """The reported hold that the next STOP asserts again (table in the head).

        ``expired``: Whether the robot has not confirmed the release in time.
        """
        own_holds, challenge = self.evidence.ours, self._live_challenge()
        is_fresh = self.evidence.report_age(at) <= LIMITS.report_fresh_s
        is_full = is_fresh and len(own_holds) >= LIMITS.most_holds
        if not own_holds or not (is_full or (expired and challenge is None)):
            return NEW_HOLD
        is_reported = self.hold_id in own_holds
        return Kept(self.hold_id if is_reported else own_holds[-1], challenge)

    def _live_challenge(self) -> str | None:
        """Challenge of a release that may still lift a hold; None: there is none."""
        attempt = self.attempt
        if attempt is None:
            return self._open_challenge
        return None if attempt.is_spent(self.evidence.report) else attempt.challenge

    def _is_hold_doubtful(self, now: Instant) -> bool:
        """Whether a hold that may have been lifted goes unreported for too long."""
        if (
            self._open_challenge is None
            or not self.wants_stop
            or self.state == "RELEASING"
        ):
            return False
        # From the episode's begin at the earliest: the robot needs time to report.
        since_report = self.evidence.report_age(now)
        return min(since_report, now.mono - self._begun_at) > LIMITS.report_fresh_s

    # --- records ------------------------------------------------------------------

    def _changed(self, key: Key, why: str | None) -> Changed:
        about = self.order or self.stop
        command_id = "" if about is None else about.command_id
        return Changed(command_id, self.state, key, why, self.commands)

    def _closed_by(self, key: Key) -> list[Closed]:
        """Effects that close the commands of the ended episode."""
        return [Closed(command.ended(key), key) for command in reversed(self.commands)]
