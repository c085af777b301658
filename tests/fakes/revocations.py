"""A store of revoked robots in memory, and a broker that follows."""

from collections.abc import Mapping

from iveg.domain.errors import HopError
from iveg.domain.revocation import BrokerTold, Revocation


class FakeRevocations:
    """Keeps what is written last; ``full`` refuses."""

    def __init__(self) -> None:
        self.written: Mapping[str, Revocation] = {}
        self.full = False

    async def save(self, revoked: Mapping[str, Revocation]) -> None:
        if self.full:
            raise HopError("disk", "no space left")
        self.written = revoked


class FakeBrokerAccess:
    """Keeps what it was told; ``away`` refuses."""

    def __init__(self) -> None:
        self.told: list[tuple[str, bool]] = []
        self.away = False

    async def change(self, robot_id: str, *, admitted: bool) -> BrokerTold:
        if self.away:
            raise HopError("broker access", "no such container")
        self.told.append((robot_id, admitted))
        return "done"
