"""A store of detectors out of service in memory, whose disk may be full."""

from collections.abc import Mapping

from iveg.domain.detector import OutOfService
from iveg.domain.errors import HopError


class FakeDetectorStore:
    """Keeps what is written last; ``full`` refuses."""

    def __init__(self) -> None:
        self.written: Mapping[str, OutOfService] = {}
        self.full = False

    async def save(self, out: Mapping[str, OutOfService], /) -> None:
        if self.full:
            raise HopError("disk", "no space left")
        self.written = out
