"""State of one STOP, RELEASE or RESUME at one moment, with the time of each step.

The times of a STOP are: pressed (browser's clock), accepted (``requested``), sent and
answered on each transport, standing.

``outcome_of`` reads rows of the history.  A row's state is the robot's when the order
was last followed, and "running" does not say how a STOP ended.  State and outcome are
described in docs/interfaces/resources.md.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from iveg.domain.observations import Instant
from iveg.domain.records import CommandRecord
from iveg.domain.stamps import wall_of
from iveg.domain.transports import Transport, TransportId

State = Literal[
    "RUNNING",
    "REQUESTED",
    "SENT",
    "DELIVERED",
    "STANDING",
    "UNCONFIRMED",
    "STILL_MOVING",
    "STALE",
    "RELEASING",
    "READY",
]
CommandState = State | Literal["REPLACED", "EXPIRED"]
"""``REPLACED``: another command took its place.  ``EXPIRED``: a release or resume
that the robot never confirmed."""
Kind = Literal["stop", "release", "resume"]

PRESS_OLDEST_S = 60.0
"""Greatest age of a plausible press (s)."""
PRESS_AHEAD_S = 0.25
"""Lead of a plausible press (s): a browser knows our clock to half a round trip."""


@dataclass(frozen=True, slots=True)
class Press:
    """A page's account of a press; a program may give none.

    Attributes:
        press_id: Id of the press, the same at every repetition.
        pressed_at: Unix time by our clock, as the browser knows it (s).
    """

    press_id: str | None = None
    pressed_at: float | None = None


PLAIN = Press()
"""A press without an account by its page."""


def believe(pressed_at: float | None, at: Instant) -> float | None:
    """The press (Unix s) if plausible: not ahead of ``at`` and not old; else None."""
    if (
        pressed_at is None
        or not -PRESS_AHEAD_S <= at.wall - pressed_at <= PRESS_OLDEST_S
    ):
        return None
    # A small lead is an error of the browser's clock, and no negative delay.
    return min(pressed_at, at.wall)


@dataclass(frozen=True, slots=True)
class Times:
    """Time of each step of a command; all but ``pressed`` on the server's clocks.

    Attributes:
        requested: When the server accepted it.
        pressed: Unix time (s); None where the page sent none, or an impossible one.
        sent: Transport → when it first took the message.
        answered: Transport → when the robot first confirmed it.
        standing: Begin of the measured standstill.
    """

    requested: Instant
    pressed: float | None = None
    sent: Mapping[TransportId, Instant] = field(default_factory=dict)
    answered: Mapping[TransportId, Instant] = field(default_factory=dict)
    standing: Instant | None = None

    def ms_from_press(self, at: Instant) -> float:
        """Time from the press, or else from the acceptance, to a moment (ms)."""
        # The press is on the wall clock; all after it is on the monotonic one.
        lead = 0.0 if self.pressed is None else self.requested.wall - self.pressed
        return max(0.0, 1000.0 * (at.mono - self.requested.mono + lead))


@dataclass(frozen=True, slots=True)
class FollowedCommand:
    """One STOP, RELEASE or RESUME as the operator follows it.

    Attributes:
        requesters: Names of the people who want it, the first first.
        tries: Number of sends before the robot stood; all transports at once count
            once.
        reason: Cause of its begin or end; None for a plain press.
        standstill_ms: First standing sample − press (ms).
        transports: Each ``pending``, ``ok``, ``failed``, ``unknown`` or ``off``
            (docs/interfaces/resources.md).
        held_as: The hold of an earlier STOP that this one asserts again.
    """

    command_id: str
    robot_id: str
    kind: Kind
    state: CommandState
    times: Times
    requesters: tuple[str, ...] = ()
    tries: int = 0
    reason: str | None = None
    standstill_ms: float | None = None
    transports: Mapping[TransportId, str] = field(default_factory=dict)
    held_as: str | None = None

    @property
    def hold_id(self) -> str | None:
        """Id of this STOP's hold at the robot; a release or resume has none."""
        return (self.held_as or self.command_id) if self.kind == "stop" else None

    @property
    def is_adopted(self) -> bool:
        """Whether it holds for another server, and nobody here wants this STOP."""
        return self.requesters == ("iveg",) and self.reason is None

    def sent(
        self, transport: Transport, left: Instant, *, ok: bool, doubtful: bool
    ) -> "FollowedCommand":
        """Note that a transport accepted the message, or failed.

        Acceptance is no arrival.  ``left`` is the time of the message's departure: the
        robot often answers before the transport does, and its answer must not look
        earlier.

        Only a broker's PUBACK of a STOP is evidence.  Orion's 204 and an order at QoS 0
        say nothing until the robot answers.
        """
        times = self.times
        if ok:
            times = replace(times, sent={transport.id: left, **times.sent})
        confirms = transport.confirms and self.kind == "stop"
        if self.transports[transport.id] == "ok" and not confirms:
            # The robot's answer was faster, and says more.
            return replace(self, times=times)
        accepted = "ok" if confirms else "pending"
        state = ("unknown" if doubtful else accepted) if ok else "failed"
        return replace(self, times=times, transports=self._with(transport.id, state))

    def confirmed(self, transport: TransportId, at: Instant) -> "FollowedCommand":
        """Note the robot's confirmation on this transport; the first one counts."""
        if transport in self.times.answered:
            return self
        times = replace(self.times, answered={**self.times.answered, transport: at})
        return replace(self, times=times)

    def answered(self, transport: TransportId, at: Instant) -> "FollowedCommand":
        """Note the robot's own answer on this transport."""
        transports = self._with(transport, "ok")
        return replace(self.confirmed(transport, at), transports=transports)

    def stood(self, first: Instant) -> "FollowedCommand":
        """Note the measured standstill since ``first``; the first one counts."""
        if self.times.standing is not None:
            return self
        return replace(
            self,
            times=replace(self.times, standing=first),
            standstill_ms=self.times.ms_from_press(first),
        )

    def ended(self, why: str) -> "FollowedCommand":
        """The closed command; ``EXPIRED``: the robot never confirmed the release."""
        if self.kind == "stop":
            return replace(self, state="REPLACED")
        is_expired = why == "release_unconfirmed"
        return replace(self, state="EXPIRED" if is_expired else "REPLACED", reason=why)

    def _with(self, transport: TransportId, state: str) -> dict[TransportId, str]:
        return {**self.transports, transport: state}


Outcome = Literal[
    "open",
    "stood",
    "not_seen_standing",
    "released",
    "resumed",
    "refused",
    "expired",
    "replaced",
    "reached",
    "cancelled",
    "deleted",
]
_OUTCOMES: Mapping[str, Outcome] = {
    "EXPIRED": "expired",
    "REPLACED": "replaced",
    "REACHED": "reached",
    "REFUSED": "refused",
    "CANCELLED": "cancelled",
    "DELETED": "deleted",
}
"""Outcome of a closed order, or of a goal, by its state."""
LOUD = frozenset({"UNCONFIRMED", "STILL_MOVING"})
"""States that call for the red button."""


def write_command(command: FollowedCommand) -> CommandRecord:
    """A command as a row; moments are Unix seconds."""
    times = command.times
    return CommandRecord(
        command_id=command.command_id,
        robot_id=command.robot_id,
        kind=command.kind,
        state=command.state,
        requested_by=command.requesters[0],
        requested_at=times.requested.wall,
        sent_at={transport: at.wall for transport, at in times.sent.items()},
        answer_at={transport: at.wall for transport, at in times.answered.items()},
        standing_at=wall_of(times.standing),
        standstill_ms=command.standstill_ms,
        tries=command.tries,
        reason=command.reason,
        pressed_at=times.pressed,
    )


def outcome_of(record: CommandRecord) -> Outcome:
    """Outcome of an order; ``open`` while it is followed."""
    if record.state in _OUTCOMES:
        return _OUTCOMES[record.state]
    if record.kind == "goal":
        return "open"
    if record.kind == "stop":
        if record.state not in ("RUNNING", "READY"):
            return "open"
        return "not_seen_standing" if record.standing_at is None else "stood"
    if record.state == "RELEASING":
        return "open"
    if record.reason is not None:
        return "refused"
    return "released" if record.kind == "release" else "resumed"


def was_loud(states: Iterable[str]) -> bool:
    """Whether a STOP was unconfirmed or not obeyed in any of these states."""
    return not LOUD.isdisjoint(states)
