"""Stores of rule versions and of a trial in memory, whose disk may be full."""

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import HopError
from iveg.domain.rule.trial import Trial


class FakeRuleStore:
    """Keeps what is written; ``full`` refuses."""

    def __init__(self) -> None:
        self.written: list[DetectionRule] = []
        self.full = False

    async def append(self, rule: DetectionRule) -> None:
        if self.full:
            raise HopError("disk", "no space left")
        self.written.append(rule)


class FakeTrialStore:
    """Keeps what was written last; ``full`` refuses."""

    def __init__(self) -> None:
        self.written: Trial | None = None
        self.full = False

    async def save(self, trial: Trial | None) -> None:
        if self.full:
            raise HopError("disk", "no space left")
        self.written = trial
