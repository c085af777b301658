"""Small stores in memory, whose disk may be full."""

from collections.abc import Mapping
from typing import Generic, TypeVar

from iveg.domain.detector import OutOfService
from iveg.domain.errors import HopError
from iveg.domain.words import WordAnswer

_T = TypeVar("_T")


class _FakeStore(Generic[_T]):
    """Keeps what is written last; ``full`` refuses."""

    def __init__(self) -> None:
        self.written: Mapping[str, _T] = {}
        self.full = False

    async def save(self, known: Mapping[str, _T], /) -> None:
        if self.full:
            raise HopError("disk", "no space left")
        self.written = known


class FakeDetectorStore(_FakeStore[OutOfService]):
    """Detectors out of service."""


class FakeWordStore(_FakeStore[WordAnswer]):
    """Answers to words of detectors."""
