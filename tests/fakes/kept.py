"""Choices of operators in memory, whose disk may be full."""

from collections.abc import Mapping
from typing import Generic, TypeVar

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import OutOfService, WordAnswer
from iveg.domain.errors import HopError
from iveg.vital.operators import Kept, KeptChoices

_T = TypeVar("_T")


class FakeStore(Generic[_T]):
    """Keeps what is written last; ``full`` refuses."""

    def __init__(self, written: _T) -> None:
        self.written = written
        self.full = False

    async def save(self, value: _T) -> None:
        if self.full:
            raise HopError("disk", "no space left")
        self.written = value

    @property
    def kept(self) -> Kept[_T]:
        return Kept(self.written, self.save)


class FakeRuleStore:
    """Keeps every rule that is written; ``full`` refuses."""

    def __init__(self) -> None:
        self.written: list[DetectionRule] = []
        self.full = False

    async def append(self, rule: DetectionRule) -> None:
        if self.full:
            raise HopError("disk", "no space left")
        self.written.append(rule)


class FakeChoices:
    """Stores of all choices."""

    def __init__(self) -> None:
        self.rules = FakeRuleStore()
        self.out_of_service = FakeStore[Mapping[str, OutOfService]]({})
        self.words = FakeStore[Mapping[str, WordAnswer]]({})

    @property
    def kept(self) -> KeptChoices:
        """As a run finds them that begins now."""
        return KeptChoices(
            [DetectionRule(), *self.rules.written],
            self.rules.append,
            self.out_of_service.kept,
            self.words.kept,
        )
