"""The longest turn of the loop, in CPU, and whose it was."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, field

import pytest

from iveg.adapters import clock
from iveg.adapters.loop_watch import BEAT_S, LoopWatch

LONG_S = 0.3


@dataclass
class Turns:
    """The long turns that a watch over this loop reports."""

    found: list[tuple[str, float]] = field(default_factory=list)
    noted: asyncio.Event = field(default_factory=asyncio.Event)

    def note(self, part: str, cpu_s: float) -> None:
        if cpu_s > LONG_S / 2:
            self.found.append((part, cpu_s))
            self.noted.set()


@pytest.fixture
async def turns() -> AsyncIterator[Turns]:
    turns = Turns()
    watching = asyncio.create_task(LoopWatch(turns.note).run())
    await asyncio.sleep(2 * BEAT_S)
    yield turns
    watching.cancel()
    await asyncio.gather(watching, return_exceptions=True)


async def compute(cpu_s: float) -> None:
    until = clock.thread_cpu() + cpu_s
    while clock.thread_cpu() < until:
        sum(range(1000))


async def test_f63_a_long_turn_is_reported_with_the_name_of_its_task(
    turns: Turns,
) -> None:
    await asyncio.create_task(compute(LONG_S), name="costmap")
    async with asyncio.timeout(30):
        await turns.noted.wait()

    ((part, cpu_s),) = turns.found
    assert part == "costmap"
    assert cpu_s > LONG_S - 2 * BEAT_S
