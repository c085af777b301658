"""One STOP, RELEASE or RESUME with the time of each of its steps.

A STOP's times are t0 the press on the browser's clock, t1 accepted (``requested``),
t2 sent and t3 answered on each road, and t4 standing (safety.md §2.4).
"""

from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.observations import Instant
from iveg.domain.stop.table import SendRoad, State

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
        roads: ``pending``, ``ok``, ``failed`` or ``off``, each.
        drill: A STOP that somebody pressed to prove that it works.
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
    roads: dict[SendRoad, str] = field(
        default_factory=lambda: {"direct": "pending", "fiware": "pending"}
    )
    drill: bool = False
