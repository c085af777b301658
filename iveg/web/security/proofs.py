"""When somebody last proved who they are, and who is asked to prove it anew.

A session lasts for a day and a screen is left alone in a minute: what lets a robot
drive again asks for a proof that is not older than some minutes.  STOP never asks.
"""

from typing import Final

from iveg.domain.accounts import OF_ACCOUNTS
from iveg.pipeline.ports import Clock
from iveg.web.errors import ProofNeededError
from iveg.web.security.roles import Principal

_ASKED: Final = OF_ACCOUNTS | {"pin"}
"""Whoever has the link alone has nothing to prove by; programs do so at each call."""


class Freshness:
    """Asks whose proof is too old.

    Args:
        within_s: How old a proof may be (s); 0: any.
        clock: Read at each question.
    """

    def __init__(self, within_s: float, clock: Clock) -> None:
        self._within_s = within_s
        self._clock = clock

    def until(self, who: Principal) -> float | None:
        """When the proof of a session is too old (Unix s); None: never."""
        if self._within_s <= 0.0 or who.method not in _ASKED:
            return None
        return (who.proven_at or 0.0) + self._within_s

    def is_stale(self, who: Principal) -> bool:
        """Whether somebody has to prove anew who they are."""
        until = self.until(who)
        return until is not None and self._clock().wall > until

    def refuse_stale(self, who: Principal) -> None:
        """Raises ProofNeededError: the proof is too old."""
        if self.is_stale(who):
            raise ProofNeededError
