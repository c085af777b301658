"""A broker and a small iVeg for tests of the emulator and the replay."""

import asyncio
import contextlib
import time
from collections import defaultdict
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import aiomqtt

from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.feedback import CLEAR, Feedback
from iveg.domain.observations import Observation, Odometry, Origin, SafetyReport
from iveg.ngsi import codec
from tests.brokers import broker_on
from tests.patience import PATIENCE_S
from tests.ports import free_ports

T = TypeVar("T")


@contextlib.asynccontextmanager
async def broker(folder: Path) -> AsyncIterator[BrokerAddress]:
    """A broker on a free port."""
    (port,) = free_ports(1)
    async with broker_on(port, folder) as address:
        yield address


async def until(true: Callable[[], object]) -> None:
    """Wait for a fact."""
    deadline = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < deadline, "did not come true in time"
        await asyncio.sleep(0.02)


@dataclass
class Cloud:
    """Hears everything, answers with feedback at 10 Hz."""

    address: BrokerAddress
    heard: dict[str, list[Observation]] = field(
        default_factory=lambda: defaultdict(list)
    )
    devices: set[str] = field(default_factory=set)
    problems: list[codec.UnreadPart] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.link = MqttLink(self.address, "cloud")

    async def run(self) -> None:
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._listen())
            tasks.create_task(self._speak())

    async def _listen(self) -> None:
        """Every message, also those that a newer one has overtaken."""
        async with aiomqtt.Client(self.address.host, self.address.port) as client:
            await client.subscribe("/iveg/+/attrs", qos=1)
            await client.subscribe("/iveg/+/cmdexe", qos=1)
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self.link.run())
                async for message in client.messages:
                    self._take(message.topic.value, bytes(message.payload))

    def of(self, robot_id: str, kind: type[T]) -> list[T]:
        """All that a robot said of one kind."""
        return [o for o in self.heard[robot_id] if isinstance(o, kind)]

    def newest(self, robot_id: str, kind: type[T]) -> T | None:
        return next(
            (o for o in reversed(self.heard[robot_id]) if isinstance(o, kind)), None
        )

    def speed(self, robot_id: str) -> float:
        newest = self.newest(robot_id, Odometry)
        return 0.0 if newest is None else abs(newest.twist.linear_x)

    def report(self, robot_id: str) -> SafetyReport:
        newest = self.newest(robot_id, SafetyReport)
        return newest or SafetyReport(robot_id, Origin(), 0.0, "stale")

    async def command(self, robot_id: str, order: codec.Order) -> None:
        await self.link.publish(f"/iveg/{robot_id}/cmd", codec.write_command(order))

    def _take(self, topic: str, payload: bytes) -> None:
        device = topic.split("/")[2]
        self.devices.add(device)
        if topic.endswith("/cmdexe"):
            reading = codec.read_answer(device, payload)
        elif device == "climate":
            return
        else:
            reading = codec.read_measure(device, payload)
        self.problems.extend(reading.problems)
        for observation in reading.observations:
            self.heard[observation_robot(observation)].append(observation)

    async def _speak(self) -> None:
        seq = 0
        while True:
            await asyncio.sleep(0.1)
            seq += 1
            if not self.link.connected:
                continue
            for robot_id in list(self.heard):
                seen = {robot_id: self.report(robot_id).origin.seq or 0}
                feedback = Feedback(
                    robot_id,
                    Origin("cloud", seq),
                    speed_limits=dict.fromkeys(self.heard, CLEAR),
                    seen=seen,
                )
                self.link.enqueue(
                    f"/{robot_id}/mqtt_feedback", codec.write_feedback(feedback), 1
                )


def observation_robot(observation: Observation) -> str:
    """Whose it is; the climate and the probe are nobody's."""
    return str(getattr(observation, "robot_id", ""))


@contextlib.asynccontextmanager
async def running(*work: asyncio.Future[None]) -> AsyncIterator[None]:
    """Let tasks run beside a test; the first to fail fails it."""
    try:
        yield
        for task in work:
            assert not task.done() or task.exception() is None
    finally:
        for task in work:
            task.cancel()
        await asyncio.gather(*work, return_exceptions=True)
