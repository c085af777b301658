"""A journal in memory, on a disk that can hang."""

import asyncio
from collections.abc import Sequence
from typing import Literal

from iveg.domain.observations import Instant


class FakeJournal:
    """Implements ``vital.ports.StopJournal``.

    Attributes:
        lines: (robot, desired, hold, by) that have reached the disk.
        named_lines: (robot, hold, named, challenge) likewise.
        opened: Cleared, the disk hangs until it is set.
    """

    def __init__(self) -> None:
        self.lines: list[tuple[str, str, str | None, str]] = []
        self.named_lines: list[tuple[str, str | None, tuple[str, ...], str]] = []
        self.opened = asyncio.Event()
        self.opened.set()

    async def log_desired(
        self,
        robot_id: str,
        desired: Literal["stopped", "run"],
        hold_id: str | None,
        by: str,
        at: Instant,  # noqa: ARG002 - the port
        *,
        named: Sequence[str] = (),
        challenge: str | None = None,
    ) -> None:
        await self.opened.wait()
        if challenge is None:
            self.lines.append((robot_id, desired, hold_id, by))
        else:
            self.named_lines.append((robot_id, hold_id, tuple(named), challenge))
