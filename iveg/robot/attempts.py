"""Verdicts of a robot on release and resume orders, so that copies change nothing.

An order arrives once on each transport and may be repeated.  The first copy is judged;
every later copy gets the same answer, even when the robot's state has changed: a
refused order stays refused. An attempt that is no longer remembered, because of its age
or a reboot, cannot act either: its challenge is spent (docs/safety.md).
"""

from dataclasses import dataclass

from iveg.robot.effects import AnswerCode

ATTEMPTS_KEPT = 64


@dataclass(frozen=True, slots=True)
class AttemptVerdict:
    """Result of an order.

    Attributes:
        answered: Hold that the answer names.
        code: ``RELEASED``, ``RESUMED`` or ``REFUSED``.
        why: The code of a refusal.
    """

    answered: str | None
    code: AnswerCode
    why: str | None = None


class Attempts:
    """Verdicts on the last 64 attempts."""

    def __init__(self) -> None:
        self._verdicts: dict[str, AttemptVerdict] = {}

    def recall(self, attempt: str | None) -> AttemptVerdict | None:
        """Verdict on an order that came before; None for the first copy."""
        return None if attempt is None else self._verdicts.get(attempt)

    def note(self, attempt: str | None, verdict: AttemptVerdict) -> None:
        """Remember a verdict; an order without an attempt cannot be remembered."""
        if attempt is None:
            return
        self._verdicts[attempt] = verdict
        while len(self._verdicts) > ATTEMPTS_KEPT:
            del self._verdicts[next(iter(self._verdicts))]
