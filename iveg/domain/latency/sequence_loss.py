"""Loss and disorder at one hop, by the count that the sender gives its messages."""

from collections import deque
from dataclasses import dataclass
from typing import Final

_RECENT_S: Final = 3
"""Length of the recent window (s)."""
_LEAP: Final = 100_000


@dataclass(frozen=True, slots=True)
class RecentLoss:
    """The last three seconds: messages passed, missing, out of order."""

    passed: int
    missing: int
    reordered: int

    @property
    def lost_share(self) -> float:
        """Of those that should have come (0 to 1)."""
        return self.missing / max(1, self.passed + self.missing)


class SequenceLoss:
    """Counts messages by their numbers.

    Attributes:
        newest: Highest number so far; None before the first of a boot.
        missing: Numbers that never came; ``reordered`` that came after a later one;
            ``repeated`` that came twice.
        unread: Came since the newest was taken, and were not looked into; ``skipped``
            of all time.  They have passed.
    """

    def __init__(self) -> None:
        self.newest: int | None = None
        self.passed = self.missing = self.reordered = self.repeated = 0
        self.unread = self.skipped = 0
        self._past: deque[tuple[int, int, int]] = deque(maxlen=_RECENT_S + 1)

    def restart(self) -> None:
        """A new boot counts from its own beginning."""
        self.newest = None

    def count(self, seq: int) -> None:
        """Count a message of a sender that leaves no number out."""
        newest = self.newest
        skipped = 0 if newest is None else seq - newest - 1
        missing = max(0, skipped - self.unread) if 0 < skipped < _LEAP else 0
        self.passed += self.unread
        self.unread = 0
        self.arrived(seq, missing)

    def arrived(self, seq: int, missing: int = 0) -> None:
        """A message, and how many that should have come before it did not."""
        self.passed += 1
        if self.newest is None or seq > self.newest:
            self.newest = seq
            self.missing += missing
        else:
            self.reordered += 1
            self.missing = max(0, self.missing - 1)

    def second(self) -> None:
        """A second has passed."""
        self._past.append((self.passed, self.missing, self.reordered))

    @property
    def lately(self) -> RecentLoss:
        """Counts of the last three seconds."""
        if not self._past:
            return RecentLoss(0, 0, 0)
        passed, missing, reordered = self._past[0]
        return RecentLoss(
            self.passed - passed,
            max(0, self.missing - missing),
            self.reordered - reordered,
        )
