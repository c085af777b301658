"""A broker that takes everything, until it is told to fail or to hang."""

import asyncio
from collections.abc import Iterable
from typing import Literal

from iveg.domain.errors import HopError
from iveg.domain.feedback import Feedback
from iveg.domain.goals import CancelOrder, GoalOrder
from iveg.domain.peer_scan import PeerScan


class FakeFleet:
    """Implements ``vital.ports.FleetPort``.

    Attributes:
        told: Feedback in the order it was offered; ``scans`` for peers likewise.
        stops: (robot, hold) in the order it was published.
        asked: (what, robot, hold ids) of each release and resume.
        orders: (challenge, attempt) of the same.
        levels: (robot, desired, ids) likewise.
        goals: (robot, order) of each goal and cancellation.
        fails: Every publication is refused.
        opened: Cleared, every STOP hangs until it is set.
    """

    def __init__(self) -> None:
        self.told: list[Feedback] = []
        self.scans: list[PeerScan] = []
        self.stops: list[tuple[str, str]] = []
        self.asked: list[tuple[str, str, tuple[str, ...]]] = []
        self.orders: list[tuple[str, str]] = []
        self.levels: list[tuple[str, str, tuple[str, ...]]] = []
        self.goals: list[tuple[str, GoalOrder | CancelOrder]] = []
        self.fails = False
        self.opened = asyncio.Event()
        self.opened.set()

    def publish_feedback(self, feedback: Feedback) -> None:
        self.told.append(feedback)

    def publish_peer_scan(self, scan: PeerScan) -> None:
        self.scans.append(scan)

    async def stop(self, robot_id: str, hold_id: str, by: str) -> None:  # noqa: ARG002 - the port
        self.stops.append((robot_id, hold_id))
        await self._answer()

    async def release(
        self, robot_id: str, ids: Iterable[str], challenge: str, attempt: str
    ) -> None:
        self.asked.append(("release", robot_id, tuple(ids)))
        self.orders.append((challenge, attempt))
        await self._answer()

    async def resume(self, robot_id: str, challenge: str, attempt: str) -> None:
        self.asked.append(("resume", robot_id, ()))
        self.orders.append((challenge, attempt))
        await self._answer()

    async def goal(self, robot_id: str, order: GoalOrder | CancelOrder) -> None:
        self.goals.append((robot_id, order))
        await self._answer()

    async def set_desired_state(
        self, robot_id: str, desired: Literal["stopped", "run"], ids: Iterable[str]
    ) -> None:
        self.levels.append((robot_id, desired, tuple(ids)))
        await self._answer()

    async def _answer(self) -> None:
        await self.opened.wait()
        if self.fails:
            raise HopError("mqtt", "not connected")
