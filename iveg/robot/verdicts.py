"""What a robot answered to each attempt of a release or resume.

Every copy of an order gets the answer of the first, even when the robot's state has
changed: a refused order stays refused.
"""

from dataclasses import dataclass, field

from iveg.robot.effects import AnswerCode

ATTEMPTS_KEPT = 64
"""The challenge of one that is forgotten is spent, so no copy of it can succeed."""

Verdict = tuple[str | None, AnswerCode, str | None]
"""On a release or resume: the hold that the answer names, and why it was refused."""


@dataclass(slots=True)
class Verdicts:
    """By attempt, oldest first."""

    _of: dict[str, Verdict] = field(default_factory=dict)

    def on(self, attempt: str) -> Verdict | None:
        """What was answered; None: it is new."""
        return self._of.get(attempt)

    def keep(self, attempt: str, verdict: Verdict) -> None:
        """Remember an answer; the oldest gives way."""
        self._of[attempt] = verdict
        if len(self._of) > ATTEMPTS_KEPT:
            del self._of[next(iter(self._of))]
