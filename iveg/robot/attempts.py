"""What this robot has said to each release and resume, so that a copy changes nothing.

An order comes once on each transport and may come again.  Whichever copy is first is
judged; every other is answered alike, also when the robot has changed meanwhile: what
was refused stays refused.  What is forgotten, by number or by a reboot, cannot act
either: its challenge is spent (docs/safety.md).
"""

from dataclasses import dataclass

from iveg.robot.effects import AnswerCode

ATTEMPTS_KEPT = 64


@dataclass(frozen=True, slots=True)
class AttemptVerdict:
    """What became of an order.

    Attributes:
        answered: The hold that the answer names.
        code: ``RELEASED``, ``RESUMED`` or ``REFUSED``.
        why: The code of a refusal.
    """

    answered: str | None
    code: AnswerCode
    why: str | None = None


class Attempts:
    """The verdicts on the last 64 attempts."""

    def __init__(self) -> None:
        self._verdicts: dict[str, AttemptVerdict] = {}

    def recall(self, attempt: str | None) -> AttemptVerdict | None:
        """The verdict on an order that came before; None where it is the first."""
        return None if attempt is None else self._verdicts.get(attempt)

    def note(self, attempt: str | None, verdict: AttemptVerdict) -> None:
        """Remember a verdict; an order without an attempt cannot be remembered."""
        if attempt is None:
            return
        self._verdicts[attempt] = verdict
        while len(self._verdicts) > ATTEMPTS_KEPT:
            del self._verdicts[next(iter(self._verdicts))]
