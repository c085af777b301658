"""An emulated robot that speaks ROS 2: its base halts alone, its topics add up."""

import asyncio
from collections.abc import AsyncIterator, Callable

import pytest

from iveg.adapters import clock
from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.geometry import REST, Twist2D
from iveg.domain.observations import (
    DetectionFrame,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
)
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.ros2_base import TIMEOUT_S, DriveWatchdog, Ros2Base
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import SimulatedWorld
from iveg.robot.ros2.config import RobotConfig, RosTable
from iveg.robot.ros2.inputs import SensorInputs
from iveg.robot.ros2.topics import sensed_topics
from iveg.ros2 import messages as ros
from tests.fakes.ros2_network import FakeNetwork

AHEAD = Twist2D(0.5, 0.1)


def test_a_base_does_what_it_was_told_last_for_half_a_second() -> None:
    base = DriveWatchdog()
    before = base.command(0.0)
    base.replace_command(AHEAD, 10.0)

    assert (before, base.command(10.0 + TIMEOUT_S)) == (REST, AHEAD)
    assert base.command(10.0 + TIMEOUT_S + 0.001) == REST


class Emulated:
    """AGII of the demo on a network in memory."""

    def __init__(self) -> None:
        greenhouse = load_greenhouse("mvsim-20x20")
        layout = lay_out(scenario_named("demo"), ["AGI", "AGII"], greenhouse)
        self.world = SimulatedWorld(greenhouse, layout, DETECTORS["perfect"], 1)
        self.rig = self.world.rigs["AGII"]
        self.network = FakeNetwork()
        self.config = RobotConfig(ros=RosTable(namespace="/agii"))
        self.base = Ros2Base(self.rig, self.world, self.network, self.config, 30.0)

    def sensed(self) -> list[Observation]:
        """What Algorithm 1 makes of everything that was published."""
        senses = SensorInputs(self.config)
        now = clock.now()
        for topic, name in sensed_topics(self.config.full_topics).items():
            writer = self.network.writers.get(name)
            if writer is not None:
                senses.receive(topic, writer.sent, now.mono - 1.0)
        return [sensed.observation for sensed in senses.tick(now)]


@pytest.fixture
async def emulated() -> AsyncIterator[Emulated]:
    found = Emulated()
    task = asyncio.create_task(found.base.run(clock.mono(), 0.0))
    mounts = found.network.writers[found.config.full_topics["tf_static"]]
    await until(lambda: mounts.sent)
    yield found
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


async def until(true: Callable[[], object]) -> None:
    deadline = clock.mono() + 30.0
    while not true():
        assert clock.mono() < deadline, "did not come true in time"
        await asyncio.sleep(0.01)


async def until_it_has_said(emulated: Emulated, topic: str, times: int) -> None:
    await until(lambda: len(emulated.network.writers[topic].sent) >= times)


async def test_algorithm_1_finds_the_robot_where_it_believes_itself(
    emulated: Emulated,
) -> None:
    await until_it_has_said(emulated, "/agii/detections_3d", 3)

    found = {type(one): one for one in emulated.sensed()}

    odometry = found[Odometry]
    assert isinstance(odometry, Odometry)
    believed = emulated.rig.odometry().pose
    assert odometry.pose.x == pytest.approx(believed.x, abs=0.05)
    assert odometry.pose.y == pytest.approx(believed.y, abs=0.05)
    assert odometry.pose.yaw == pytest.approx(believed.yaw, abs=0.05)
    assert {LaserScan, DetectionFrame, Navigation} <= set(found)


async def test_it_drives_to_a_goal_and_ignores_one_without_a_way(
    emulated: Emulated,
) -> None:
    header = ros.Header(ros.Time(), "map")
    for x, y in ((18.0, 10.0), (2.0, 5.0)):
        pose = ros.Pose(ros.Point(x, y))
        emulated.network.publish("/agii/goal_pose", ros.PoseStamped(header, pose))
        await until(lambda: not emulated.network.readers["/agii/goal_pose"].waiting)

    assert emulated.rig.navigation().goal == (18.0, 10.0)


async def test_it_drives_as_it_is_told_and_halts_when_nothing_comes(
    emulated: Emulated,
) -> None:
    def drives() -> bool:
        emulated.network.publish("/agii/cmd_vel", ros.Twist(ros.Vector3(0.5)))
        return emulated.rig.vehicle.twist.linear_x > 0.1

    await until(drives)
    await until(lambda: emulated.rig.vehicle.twist == REST)

    assert emulated.rig.command == REST
