"""One STOP, RELEASE or RESUME with the time of each of its steps.

A STOP's times are t0 the press on the browser's clock, t1 accepted (``requested``),
t2 sent and t3 answered on each road, and t4 standing (safety.md §2.4).
"""

from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.observations import Instant, Road
from iveg.domain.stop.table import State, Transport

CommandState = State | Literal["REPLACED", "EXPIRED"]
"""``REPLACED``: another command took its place.  ``EXPIRED``: a release or resume
that the robot never confirmed."""

PRESS_OLDEST_S = 60.0
PRESS_AHEAD_S = 0.25
"""A browser knows our clock to half a round trip; more ahead than this is no error."""


@dataclass(frozen=True, slots=True)
class Press:
    """What a page says of a press; a program may say nothing.

    Attributes:
        press_id: The same on every transport and at every repetition.
        pressed_at: Unix time by our clock, as the browser knows it (s).
        drill: A proof test, not a need.
    """

    press_id: str | None = None
    pressed_at: float | None = None
    drill: bool = False


def believe(pressed_at: float | None, at: Instant) -> float | None:
    """When it was pressed (Unix s), if that can be: never ahead of ``at``, not old."""
    if pressed_at is None:
        return None
    if not -PRESS_AHEAD_S <= at.wall - pressed_at <= PRESS_OLDEST_S:
        return None
    return min(pressed_at, at.wall)


@dataclass(slots=True)
class Times:
    """When each step of a command was taken; all but ``pressed`` on our clocks.

    Attributes:
        pressed: Unix time (s); None where nobody said, or it was not believed.
        pressed_doubted: Somebody said a time that cannot be.
    """

    requested: Instant
    pressed: float | None = None
    pressed_doubted: bool = False
    sent_direct: Instant | None = None
    sent_fiware: Instant | None = None
    answer_direct: Instant | None = None
    answer_fiware: Instant | None = None
    standing: Instant | None = None

    @classmethod
    def of(cls, at: Instant, press: Press) -> "Times":
        """Accepted now; pressed when the page says, if that can be."""
        pressed = believe(press.pressed_at, at)
        doubted = pressed is None and press.pressed_at is not None
        return cls(at, pressed, doubted)

    def note_word(self, at: Instant, road: Road) -> None:
        """The robot has said, for the first time on this way, that it has it."""
        if road == "mqtt":
            self.answer_direct = self.answer_direct or at
        else:
            self.answer_fiware = self.answer_fiware or at

    def ms_from_press(self, at: Instant) -> float:
        """From the press, or the acceptance where it is unknown, to a moment (ms)."""
        lead = 0.0 if self.pressed is None else self.requested.wall - self.pressed
        return max(0.0, 1000.0 * (at.mono - self.requested.mono + lead))


@dataclass(slots=True)
class Command:
    """One STOP, RELEASE or RESUME as people follow it.

    Attributes:
        reason: Why it began or ended as it did; None for a plain press.
        standstill_ms: First standing sample − press.
        tries: How often it was sent before the robot stood; both transports at once
            count once.
        roads: Per transport ``pending``, ``ok``, ``failed``, ``unknown`` or ``off``
            (docs/interfaces.md §8).
        drill: A STOP that somebody pressed to prove that it works.
        held_as: The hold of an earlier STOP that this one holds on to.
        agent_lag_s: How far the IoT Agent was behind when it was sent (s); None where
            nobody knows.
    """

    command_id: str
    robot_id: str
    kind: Literal["stop", "release", "resume"]
    state: CommandState
    times: Times
    requesters: list[str] = field(default_factory=list)
    tries: int = 0
    reason: str | None = None
    standstill_ms: float | None = None
    roads: dict[Transport, str] = field(
        default_factory=lambda: {"direct": "pending", "fiware": "pending"}
    )
    drill: bool = False
    held_as: str | None = None
    agent_lag_s: float | None = None

    @property
    def hold_id(self) -> str | None:
        """What this STOP is called at the robot; a release or resume holds nothing."""
        return (self.held_as or self.command_id) if self.kind == "stop" else None

    def note_sent(
        self, transport: Transport, left: Instant, *, ok: bool, doubtful: bool
    ) -> None:
        """A transport took what ``left`` for it, or failed; taken is not yet arrived.

        Sent is when it left: the robot's answer is often here before the word of who
        took it, and no answer comes before its question.

        Only a broker's word that it has a STOP (PUBACK) says something; Orion's 204
        and an order at QoS 0 say nothing until the robot answers.
        """
        if ok and transport == "direct":
            self.times.sent_direct = self.times.sent_direct or left
        elif ok:
            self.times.sent_fiware = self.times.sent_fiware or left
        confirms = transport == "direct" and self.kind == "stop"
        if self.roads[transport] == "ok" and not confirms:
            return  # The robot's answer was faster than the word of who took it.
        taken = "ok" if confirms else "pending"
        self.roads[transport] = ("unknown" if doubtful else taken) if ok else "failed"

    def note_answer(self, at: Instant, road: Road) -> None:
        """The robot's own answer to it has come."""
        self.times.note_word(at, road)
        self.roads["direct" if road == "mqtt" else "fiware"] = "ok"
