"""Evidence of one robot's detector: whether its pictures are read whole.

Silence, a refused frame and a healthy empty aisle must never look alike, so only one
thing proves that a detector works::

    a frame read whole, at most a second old, and none in that second that was not

Until then it is *missing* (docs/safety.md, "Clear"), unless an operator took it out of
service.
"""

import math
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.limits import LIMITS
from iveg.domain.observations import DetectionFrame, Instant
from iveg.domain.words import HeardWords

_MOST_NAMES = 4
FRAMES_HZ = 45.0
"""Most frames of a robot in the mean of a second; the contract's rate is 30 Hz."""

Flaw = Literal["unreadable", "overload", "unplaced", "strange", "blind"]
"""Why a frame was not read whole: it or a box of a person or robot was refused, more
came than can be judged, the robot's pose has never been told, its detector says nothing
that anybody understands, or it shows nobody where another one surely sees somebody."""


def flaw_of(
    frame: DetectionFrame,
    rule: DetectionRule,
    turned_away: int = 0,
    unplaced: int = 0,
    *,
    has_pose: bool = True,
) -> Flaw | None:
    """Why a judged frame does not count as read whole; None: it does.

    Args:
        frame: The frame; an unread box counts where it may show a person or robot.
        rule: Knows which classes these are.
        turned_away: Detections for which there was no room.
        unplaced: Detections of somebody whose place nobody knows.
        has_pose: Whether the robot's pose has ever been told.
    """
    if turned_away:
        return "overload"
    unread = frame.unread
    if None in unread or any(map(rule.class_of, unread)):
        return "unreadable"
    if unplaced:
        return "unreadable" if has_pose else "unplaced"
    return None


@dataclass(frozen=True, slots=True)
class OutOfService:
    """An operator's word that a detector is not to be waited for.

    Attributes:
        by: Who said so; ``since`` when (Unix s).
        reason: Why; empty in what an earlier iVeg kept.
        boot: Of the robot at that moment; another one ends it.  None before the first.
    """

    by: str
    since: float
    boot: str | None = None
    reason: str = ""


@dataclass(slots=True)
class DetectorEvidence:
    """The evidence of one detector; moments are monotonic seconds.

    Attributes:
        whole_at: The newest frame that was read whole was not measured before this
            moment; None before the first, and while its age is not known.
        flawed_at: When a frame was last not read whole, by flaw.
        worked: Whether it was ever proven to work.
        out_of_service: None: it is required.
        words: What it says, by its name: of the four that came last.
        blind_by: The robot that sees somebody whom its camera does not show.
    """

    whole_at: float | None = None
    flawed_at: dict[Flaw, float] = field(default_factory=dict)
    worked: bool = False
    out_of_service: OutOfService | None = None
    words: dict[str, HeardWords] = field(default_factory=dict)
    blind_by: str | None = None
    _allowance: float = FRAMES_HZ
    _counted_at: float | None = None

    def words_of(self, name: str) -> HeardWords:
        """Words heard of a detector of this name, which is now the newest."""
        self.words[name] = self.words.pop(name, HeardWords())
        if len(self.words) > _MOST_NAMES:
            del self.words[next(iter(self.words))]
        return self.words[name]

    def admits_frame(self, now: Instant) -> bool:
        """Whether one more frame may be judged; counts it if so."""
        before = now.mono if self._counted_at is None else self._counted_at
        earned = FRAMES_HZ * max(0.0, now.mono - before)
        self._allowance = min(FRAMES_HZ, self._allowance + earned)
        self._counted_at = now.mono
        admitted = self._allowance >= 1.0
        self._allowance -= admitted
        return admitted

    def note_whole(self, measured_at: float | None) -> None:
        """Note a frame that was read whole; None: nobody knows its age."""
        self.whole_at = measured_at
        self.worked = self.worked or measured_at is not None

    def note_flaw(self, flaw: Flaw, now: Instant) -> None:
        """Note a frame that was not."""
        self.flawed_at[flaw] = now.mono

    def is_flawed(self, now: Instant, *, but: Flaw | None = None) -> bool:
        """Whether a frame was not read whole within the silence limit.

        ``but``: for any other reason than this.
        """
        if not self.flawed_at:
            return False
        newest = [at for flaw, at in self.flawed_at.items() if flaw != but]
        return now.mono - max(newest, default=-math.inf) <= LIMITS.silence_s

    def is_missing(self, now: Instant) -> bool:
        """Whether nothing proves that it works; one out of service is not waited for.

        A frame that is refused counts even then: somebody may be in it.
        """
        if self.is_flawed(now):
            return True
        if self.out_of_service is not None:
            return False
        return self.whole_at is None or now.mono - self.whole_at > LIMITS.silence_s

    def meet_boot(self, boot: str | None) -> bool:
        """Meet a message of a boot; whether that puts the detector back in service."""
        ended = self.out_of_service
        if ended is None or boot is None or boot == ended.boot:
            return False
        self.out_of_service = None
        return True
