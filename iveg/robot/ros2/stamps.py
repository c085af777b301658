"""Order of one topic's messages by their stamps, until its clock was set back."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["new", "same", "back", "reset"]
_BACK_MESSAGES = 5


@dataclass(slots=True)
class Stamps:
    """Newest stamp of one topic (s), and how many in a row were before it."""

    newest: float = 0.0
    back: int = 0

    def verdict(self, stamp: float) -> Verdict:
        """``new``, ``same``, ``back``, or ``reset`` when the clock was set back."""
        if stamp > self.newest or stamp == 0.0:
            self.newest, self.back = max(stamp, self.newest), 0
            return "new"
        if stamp == self.newest:
            return "same"
        self.back += 1
        if self.back < _BACK_MESSAGES:
            return "back"
        self.newest, self.back = stamp, 0
        return "reset"
