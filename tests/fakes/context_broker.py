"""An Orion that answers 204, until it is told to fail or to hang."""

import asyncio
from collections.abc import Iterable

from iveg.domain.errors import HopError
from iveg.domain.goals import CancelOrder, GoalOrder


class FakeContextBroker:
    """Implements ``vital.ports.CommandPort``.

    Attributes:
        asked: (what, robot, hold ids) in the order it was asked.
        orders: (challenge, attempt) of each release and resume.
        in_flight: Requests that have not come back; ``most`` the most there ever were.
        fails: Raised by every request, if set.
        opened: Cleared, every request hangs until it is set.
    """

    def __init__(self) -> None:
        self.asked: list[tuple[str, str, tuple[str, ...]]] = []
        self.orders: list[tuple[str, str]] = []
        self.in_flight = self.most = 0
        self.fails: Exception | None = None
        self.opened = asyncio.Event()
        self.opened.set()

    async def stop(self, robot_id: str, hold_id: str, by: str) -> None:  # noqa: ARG002 - the port
        await self._ask("stop", robot_id, (hold_id,))

    async def release(
        self, robot_id: str, ids: Iterable[str], challenge: str, attempt: str
    ) -> None:
        self.orders.append((challenge, attempt))
        await self._ask("release", robot_id, tuple(ids))

    async def resume(self, robot_id: str, challenge: str, attempt: str) -> None:
        self.orders.append((challenge, attempt))
        await self._ask("resume", robot_id, ())

    async def goal(self, robot_id: str, order: GoalOrder | CancelOrder) -> None:
        await self._ask("goal", robot_id, (order.goal_id,))

    def refuse(self) -> None:
        """From now on Orion is down."""
        self.fails = HopError("orion", "cannot be reached")

    async def _ask(self, what: str, robot_id: str, ids: tuple[str, ...]) -> None:
        self.asked.append((what, robot_id, ids))
        self.in_flight += 1
        self.most = max(self.most, self.in_flight)
        try:
            await self.opened.wait()
            if self.fails is not None:
                raise self.fails
        finally:
            self.in_flight -= 1
