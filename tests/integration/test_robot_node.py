"""A robot node on a real broker, on a free port of loopback.

Mosquitto where it is installed, the embedded broker elsewhere.
"""

import asyncio
import contextlib
from collections import Counter
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from iveg.adapters import clock
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.feedback import CLEAR, Feedback, SpeedLimit
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import (
    CommandAnswer,
    Instant,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.ngsi import codec
from iveg.robot.node import NodeSettings, RobotNode
from tests.brokers import broker_on
from tests.integration.emulator_cloud import until
from tests.ports import free_ports


@pytest.fixture
def port() -> int:
    (free,) = free_ports(1)
    return free


@pytest.fixture
async def broker(port: int, tmp_path: Path) -> AsyncIterator[BrokerAddress]:
    async with broker_on(port, tmp_path) as address:
        yield address


@dataclass
class Cloud:
    """A small iVeg: hears everything, sends feedback at 10 Hz while ``speaks``."""

    address: BrokerAddress
    answers: list[CommandAnswer] = field(default_factory=list)
    reports: list[SafetyReport] = field(default_factory=list)
    topics: Counter[str] = field(default_factory=Counter)
    speaks: bool = True
    speed_limit: SpeedLimit | None = None
    backlog_s: float | None = None
    seq: int = 0
    boot: str = "cloud"

    def __post_init__(self) -> None:
        self.link = MqttLink(
            self.address, "cloud", {"/iveg/#": 1, "/AGI/iveg/+": 1}, self.take
        )

    def take(self, topic: str, payload: bytes) -> None:
        self.topics[topic] += 1
        device = topic.split("/")[2]
        if topic.endswith("/cmdexe"):
            for one in codec.read_answer(device, payload).observations:
                assert isinstance(one, CommandAnswer)
                self.answers.append(one)
        elif device.endswith("_safety"):
            for said in codec.read_measure(device, payload).observations:
                assert isinstance(said, SafetyReport)
                self.reports.append(said)

    async def speak(self) -> None:
        while True:
            await asyncio.sleep(0.1)
            if self.speaks and self.link.connected and self.reports:
                self.seq += 1
                newest = self.reports[-1].origin.seq or 0
                speed_limits = {"AGI": self.speed_limit or CLEAR}
                feedback = Feedback(
                    "AGII",
                    Origin(self.boot, self.seq),
                    speed_limits=speed_limits,
                    seen={"AGI": newest},
                    backlog_s=self.backlog_s,
                )
                self.link.enqueue(
                    "/AGII/mqtt_feedback", codec.write_feedback(feedback), qos=1
                )

    async def command(self, payload: bytes) -> None:
        await self.link.publish("/iveg/AGI/cmd", payload)


@dataclass
class HeldClock:
    """Goes on between what the robot does, never within it: one call, one time."""

    now: Instant = field(default_factory=clock.now)

    def __call__(self) -> Instant:
        return self.now

    async def run(self) -> None:
        while True:
            await asyncio.sleep(0.002)
            self.now = clock.now()


@dataclass
class Robot:
    """A node on a drive that obeys at once, with odometry and wishes at 20 Hz.

    Attributes:
        driven: What the drive was told, and when by the node's own clock (s).
    """

    node: RobotNode
    driven: list[tuple[float, Twist2D]]
    clock: HeldClock
    wished: Twist2D = field(default_factory=lambda: Twist2D(1.0, 0.2))

    def odometry(self) -> Odometry:
        return Odometry("", Origin(), Pose2D(0.0, 0.0, 0.0), self.driven[-1][1])

    async def live(self) -> None:
        while True:
            self.node.sense(self.odometry())
            self.node.request_twist(
                self.wished if self.node.may_drive else Twist2D(0.0, 0.0)
            )
            await asyncio.sleep(0.05)

    @property
    def speed(self) -> float:
        return self.driven[-1][1].linear_x


def make_robot(address: BrokerAddress, folder: Path) -> Robot:
    now = HeldClock()
    driven = [(now().mono, Twist2D(0.0, 0.0))]
    node = RobotNode(
        "AGI",
        NodeSettings(address=address, apikey="iveg", directory=folder, read_clock=now),
        profile=RobotProfile(),
        drive=lambda twist: driven.append((now().mono, twist)),
    )
    return Robot(node, driven, now)


@contextlib.asynccontextmanager
async def running(robot: Robot, cloud: Cloud) -> AsyncIterator[None]:
    async with asyncio.TaskGroup() as tasks:
        jobs = [
            tasks.create_task(work)
            for work in (cloud.link.run(), cloud.speak(), robot.node.run())
        ]
        jobs.append(tasks.create_task(robot.clock.run()))
        jobs.append(tasks.create_task(robot.live()))
        await until(lambda: cloud.link.connected and robot.node.connected)
        yield
        for job in jobs:
            job.cancel()


async def release(cloud: Cloud, robot: Robot) -> None:
    """What iVeg does for a person who releases and resumes."""
    await until(lambda: cloud.reports and robot.node.state == "STANDING")
    before = len(cloud.answers)
    said = cloud.reports[-1]
    ids = [hold.id for hold in said.holds]
    await cloud.command(
        codec.write_command(codec.write_release(ids, said.challenge or "", "01T"))
    )
    await until(lambda: len(cloud.answers) > before)
    challenge = cloud.answers[-1].challenge or ""
    await cloud.command(codec.write_command(codec.write_resume(challenge, "01U")))
    await until(lambda: len(cloud.answers) > before + 1)


async def test_a_held_robot_reports_past_the_agent_and_spares_it_poses_when_told(
    broker: BrokerAddress, tmp_path: Path
) -> None:
    cloud, robot = Cloud(broker), make_robot(broker, tmp_path)
    straight, measured = "/AGI/iveg/safety", "/iveg/AGI_safety/attrs"
    async with running(robot, cloud):
        await until(lambda: cloud.topics[straight] > 20)
        assert cloud.topics[measured] < 0.6 * cloud.topics[straight]
        assert cloud.topics["/AGI/iveg/odom"] == 0
        cloud.backlog_s = 10.0
        await until(lambda: cloud.topics["/AGI/iveg/odom"] > 5)
    assert cloud.topics["/iveg/AGI_odom/attrs"] > 20


async def test_a_released_and_resumed_robot_drives_and_a_stop_zeroes_it(
    broker: BrokerAddress, tmp_path: Path
) -> None:
    cloud, robot = Cloud(broker), make_robot(broker, tmp_path)
    async with running(robot, cloud):
        await release(cloud, robot)
        await until(lambda: robot.speed > 0.9)
        await cloud.command(codec.write_command(codec.write_stop("01STOP", "opaque")))
        await until(lambda: robot.speed == 0.0)
        await until(lambda: cloud.answers[-1].id == "01STOP")
    results = [answer.result for answer in cloud.answers]
    assert results == ["RELEASED", "RESUMED", "LATCHED"]


async def test_a_crew_at_the_robot_lets_it_drive_and_a_speed_limit_halves_it(
    broker: BrokerAddress, tmp_path: Path
) -> None:
    cloud, robot = Cloud(broker), make_robot(broker, tmp_path)
    robot.node.release_locally()
    async with running(robot, cloud):
        await until(lambda: robot.speed > 0.9)
        cloud.speed_limit = SpeedLimit(0.5, "person", "person-1", 1.4, "d-1")
        await until(lambda: robot.speed == 0.5)
        await until(lambda: cloud.reports[-1].reason == "person")
        assert cloud.reports[-1].cause == "person-1"


async def test_a_broker_that_goes_and_comes_back_needs_no_hand(
    port: int, tmp_path: Path
) -> None:
    address = BrokerAddress("127.0.0.1", port)
    cloud, robot = Cloud(address), make_robot(address, tmp_path)
    robot.node.release_locally()
    async with contextlib.AsyncExitStack() as first:
        await first.enter_async_context(broker_on(port, tmp_path))
        async with running(robot, cloud):
            await until(lambda: robot.speed > 0.9)
            await first.aclose()
            await until(lambda: robot.node.holds)
            assert robot.speed == 0.0
            async with broker_on(port, tmp_path):
                await until(lambda: not robot.node.holds)
                await until(lambda: robot.speed > 0.9)


async def test_a_retained_level_holds_a_robot_that_comes_later(
    broker: BrokerAddress, tmp_path: Path
) -> None:
    cloud, robot = Cloud(broker), make_robot(broker, tmp_path)
    robot.node.release_locally()
    level = codec.write_desired("stopped", ["01STOP"])
    async with asyncio.TaskGroup() as tasks:
        job = tasks.create_task(cloud.link.run())
        await until(lambda: cloud.link.connected)
        await cloud.link.publish("/AGI/iveg/desired", level, retain=True)
        job.cancel()
    async with running(robot, Cloud(broker)):
        await until(lambda: robot.node.holds)
    assert [hold.id for hold in robot.node.holds] == ["01STOP"]


async def test_feedback_that_the_broker_retained_is_of_the_past_and_no_author(
    broker: BrokerAddress, tmp_path: Path
) -> None:
    cloud, robot = Cloud(broker), make_robot(broker, tmp_path)
    old = codec.write_feedback(Feedback("AGI", Origin("old", 7)))
    async with asyncio.TaskGroup() as tasks:
        job = tasks.create_task(cloud.link.run())
        await until(lambda: cloud.link.connected)
        for qos, topic in enumerate(("/AGI/mqtt_feedback", "/AGII/mqtt_feedback")):
            await cloud.link.publish(topic, old, qos=qos, retain=True)
        job.cancel()
    cloud = Cloud(broker)
    async with running(robot, cloud):
        await until(lambda: cloud.reports and cloud.reports[-1].origin.echoes)
        echoes = cloud.reports[-1].origin.echoes
    assert {one.boot for one in echoes} == {"cloud"}
