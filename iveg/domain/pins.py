"""PINs of people on a shared tablet, and how long wrong ones are waited for.

A PIN is short, so few tries are what makes it worth something: after each fifth wrong
one of a person in a row theirs is refused for a while, four times longer each time.
"""

from itertools import pairwise
from typing import Final

LEAST_DIGITS, MOST_DIGITS = 4, 8
TRIES: Final = 5
FIRST_BLOCK_S, LONGEST_BLOCK_S, GROWTH = 60.0, 86400.0, 4.0


def is_pin(text: str) -> bool:
    """Whether somebody may choose it: 4 to 8 digits, neither one digit nor a run."""
    if not (text.isascii() and text.isdigit()):
        return False
    steps = {ord(b) - ord(a) for a, b in pairwise(text)}
    is_run = len(steps) == 1 and steps <= {-1, 0, 1}
    return LEAST_DIGITS <= len(text) <= MOST_DIGITS and not is_run


class PinGuard:
    """Counts tries of each person; those of a person with a PIN alone, so bounded."""

    def __init__(self) -> None:
        self._tries: dict[str, int] = {}
        self._until: dict[str, float] = {}

    def wait_s(self, account_id: str, now: float) -> float:
        """How long this person's PIN is still refused (s, by the monotonic clock)."""
        return max(0.0, self._until.get(account_id, now) - now)

    def trying(self, account_id: str, now: float) -> None:
        """Count a try as a wrong one, before it is looked at.

        So tries side by side are no more than tries in a row.
        """
        tries = self._tries[account_id] = self._tries.get(account_id, 0) + 1
        if tries % TRIES == 0:
            block_s = FIRST_BLOCK_S * GROWTH ** min(tries // TRIES - 1, 10)
            self._until[account_id] = now + min(block_s, LONGEST_BLOCK_S)

    def untried(self, account_id: str) -> None:
        """Take back a try that nobody could look at."""
        tries = self._tries[account_id] = self._tries[account_id] - 1
        if (tries + 1) % TRIES == 0:
            self._until.pop(account_id, None)

    def left(self, account_id: str) -> int:
        """Tries until the next block."""
        return TRIES - self._tries.get(account_id, 0) % TRIES

    def right(self, account_id: str) -> None:
        """Forget the tries of somebody who has proven who they are."""
        self._tries.pop(account_id, None)
        self._until.pop(account_id, None)
