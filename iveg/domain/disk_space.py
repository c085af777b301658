"""Room on a disk: when people are told that it runs out, and when it is well again."""

from collections.abc import Iterable
from dataclasses import dataclass

from iveg.domain.events import Condition

LEAST_BYTES, LEAST_SHARE = 10**9, 0.05
"""Below the lesser of these the disk is low."""
WELL_AGAIN = 1.2
"""It is low until there is so many times that room."""


@dataclass(frozen=True, slots=True)
class DiskSpace:
    """Room on the disk that holds the data (bytes).

    Attributes:
        free: For iVeg's user.
        total: Of the file system.
    """

    free: int
    total: int

    @property
    def least(self) -> float:
        """Below this the disk is low (bytes)."""
        return min(LEAST_BYTES, LEAST_SHARE * self.total)

    def is_low(self, *, was_low: bool) -> bool:
        """Whether it is low now; what was low is so until it is well again."""
        return self.free < self.least * (WELL_AGAIN if was_low else 1.0)

    def conditions(self, *, was_low: bool) -> Iterable[Condition]:
        """A P2 while it is low."""
        if self.is_low(was_low=was_low):
            slots = {
                "free_mb": self.free // 10**6,
                "least_mb": int(self.least) // 10**6,
            }
            yield Condition("P2", "alert.disk_low", "disk", None, slots)
