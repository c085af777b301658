"""Vital parts share one fate, comfort has none: one may end, the others go on."""

import asyncio

import pytest

from iveg.domain.errors import VitalPartError
from iveg.vital.supervision import Supervision
from tests.fakes.clock import FakeClock


class Parts:
    """One vital part that breaks when it is told to, and one of comfort."""

    def __init__(self) -> None:
        self.supervision = Supervision(FakeClock(), first_pause_s=0.001)
        self.breaks = asyncio.Event()
        self.drawn = asyncio.Event()
        self.draws = 0
        self.said: list[str] = []

    async def judge(self) -> None:
        await self.breaks.wait()
        raise ValueError("judged wrongly")

    async def talk(self) -> None:
        await asyncio.Event().wait()

    async def draw(self) -> None:
        self.draws += 1
        if self.draws < 3:
            raise ValueError("drawn wrongly")
        self.drawn.set()
        await asyncio.Event().wait()

    async def last_word(self) -> None:
        self.said.append("slow")

    async def live(self) -> None:
        vital = {"rule-loop": self.judge, "mqtt": self.talk}
        comfort = {"costmap": self.draw}
        await self.supervision.run(vital, comfort, self.last_word)


async def test_f61_a_part_of_comfort_that_fails_is_started_again_and_ends_nothing() -> (
    None
):
    parts = Parts()
    living = asyncio.create_task(parts.live())
    async with asyncio.timeout(30):
        await parts.drawn.wait()

    assert not living.done()
    assert parts.said == []
    living.cancel()
    await asyncio.gather(living, return_exceptions=True)


async def test_f62_a_vital_part_that_fails_has_a_last_word_and_ends_all() -> None:
    parts = Parts()
    parts.breaks.set()

    async with asyncio.timeout(30):
        with pytest.raises(VitalPartError, match="rule-loop") as failed:
            await parts.live()

    assert parts.said == ["slow"]
    assert isinstance(failed.value.__cause__, ValueError)
    assert len(asyncio.all_tasks()) == 1


async def test_f62_a_last_word_that_fails_keeps_nobody(
    caplog: pytest.LogCaptureFixture,
) -> None:
    parts = Parts()
    parts.breaks.set()

    async def fail() -> None:
        raise ConnectionResetError

    with pytest.raises(VitalPartError):
        await parts.supervision.run({"rule-loop": parts.judge}, {}, fail)

    assert "robots slow by themselves" in caplog.text
