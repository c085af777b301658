"""A store of rule versions in memory, whose disk may be full."""

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import HopError


class FakeRuleStore:
    """Keeps what is written; ``full`` refuses."""

    def __init__(self) -> None:
        self.written: list[DetectionRule] = []
        self.full = False

    async def append(self, rule: DetectionRule) -> None:
        if self.full:
            raise HopError("disk", "no space left")
        self.written.append(rule)
