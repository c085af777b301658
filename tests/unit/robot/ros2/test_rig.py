"""A ROS 2 robot's topics and its safety node, on a network in memory."""

import asyncio
import math
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from iveg.adapters import clock
from iveg.adapters.mqtt import BrokerAddress
from iveg.domain.feedback import Feedback
from iveg.domain.geometry import Pose2D
from iveg.domain.goals import Goal
from iveg.domain.observations import Origin
from iveg.robot.costmap import FleetCostmap
from iveg.robot.node import NodeSettings
from iveg.robot.ros2.config import RobotConfig, RosTable
from iveg.robot.ros2.inputs import SensorInputs
from iveg.robot.ros2.rig import Ros2Robot
from iveg.ros2 import messages as ros
from tests.builders import AGI
from tests.fakes.ros2_network import FakeNetwork, endpoint
from tests.ports import free_ports
from tests.unit.robot.rig import until


@dataclass
class Site:
    """A robot that runs; no broker answers it."""

    robot: Ros2Robot
    network: FakeNetwork
    task: asyncio.Task[None]

    @property
    def driven(self) -> list[ros.Twist]:
        """All that the base was told."""
        return self.network.writers["/agi/cmd_vel"].said()

    def faults(self) -> set[str]:
        now = clock.mono()
        return {one.code for one in self.robot.inputs.input_faults.faults(now)}


@pytest.fixture
async def site(tmp_path: Path) -> AsyncIterator[Site]:
    (port,) = free_ports(1)
    network = FakeNetwork()
    address = BrokerAddress("127.0.0.1", port)
    settings = NodeSettings(address=address, apikey="iveg", directory=tmp_path)
    config = RobotConfig(ros=RosTable(namespace="/agi"))
    inputs = SensorInputs(config)
    robot = Ros2Robot("AGI", config, network, inputs, settings, AGI)
    task = asyncio.create_task(robot.run())
    yield Site(robot, network, task)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


def placed(network: FakeNetwork) -> None:
    """Odometry in map, as a localised robot has it."""
    header = ros.Header(ros.Time.from_seconds(clock.wall()), "map")
    links = (ros.TransformStamped(header, "odom"),)
    network.publish("/agi/tf", ros.TFMessage(links))
    odom = ros.Header(header.stamp, "odom")
    network.publish("/agi/odom", ros.Odometry(odom, "base_link"))


async def test_a_goal_goes_out_as_nav2_takes_it_and_one_that_nobody_hears_is_none(
    site: Site,
) -> None:
    goal = Goal("01G", "here", 0.0, 5.0)
    assert not site.robot.navigate(goal), "it has no place yet"
    placed(site.network)
    await until(site.robot.inputs.pose)
    writer = site.network.writers["/agi/goal_pose"]

    assert site.robot.navigate(goal)
    assert site.robot.navigate(Goal("01H", "pause", 9.0, 9.0))
    assert site.robot.navigate(None), "it is given up by staying"
    writer.readers = 0
    assert not site.robot.navigate(goal)

    sent, paused, stays = writer.said()
    assert sent.header.frame_id == "map"
    assert (sent.pose.position.x, sent.pose.position.y) == (0.0, 5.0)
    assert sent.pose.orientation.z == pytest.approx(math.sin(math.pi / 4))
    assert paused.pose == stays.pose == ros.Pose()


async def test_a_second_publisher_of_the_drives_topic_makes_it_stand(
    site: Site,
) -> None:
    placed(site.network)
    site.network.others.append(endpoint("/agi/cmd_vel", ros.Twist))

    await until(lambda: "second_publisher" in site.faults())
    await until(lambda: site.robot.node.machine.cap.factor == 0.0)


def tell(site: Site, x: float) -> None:
    """Feedback of iVeg names a peer at this place (m)."""
    peer = Feedback("AGII", Origin("c", 1), pose=Pose2D(x, 0.0, 0.0), seen={})
    site.robot.node.machine.authors.apply("AGII", peer, None, None, clock.mono())


async def test_neighbours_go_out_for_the_costmap_and_for_rviz(site: Site) -> None:
    placed(site.network)
    tell(site, 3.0)

    cloud, markers = (
        site.network.writers[f"/agi/iveg/{name}"] for name in ("obstacles", "markers")
    )
    await until(lambda: markers.sent and markers.said()[-1].markers)

    assert cloud.said()[-1].header.frame_id == "base_link"
    assert {one.text for one in markers.said()[-1].markers} == {"", "AGII"}


async def test_the_fleets_picture_goes_out_while_somebody_listens(site: Site) -> None:
    writer = site.network.writers["/agi/iveg/costmap"]
    _, qos = site.network.asked["/agi/iveg/costmap"]
    placed(site.network)
    tell(site, 5.0)

    await until(lambda: writer.sent and (writer.said()[-1].data == 100).any())
    grid, asks = writer.said()[-1], site.robot.node.asks_for_scans
    writer.readers = 0
    await until(lambda: (writer.said()[-1].data == -1).all())
    last, before = len(writer.sent), len(site.driven)
    await until(lambda: len(site.driven) > before + 60)

    assert len(writer.sent) == last
    assert (asks, site.robot.node.asks_for_scans) == (True, False)
    assert (qos.reliable, qos.transient_local, qos.depth) == (True, True, 1)
    assert grid.header.frame_id == "map"
    row, column = divmod(int((grid.data == 100).argmax()), grid.info.width)
    assert abs(grid.info.origin.position.x + column * grid.info.resolution - 5.0) < 1.0
    assert abs(grid.info.origin.position.y + row * grid.info.resolution) < 1.0


async def test_a_gate_goes_on_while_the_costmap_fails(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    failures: list[object] = []

    def fail(*args: object) -> None:
        failures.append(args)
        raise ValueError

    monkeypatch.setattr(FleetCostmap, "draw", fail)
    placed(site.network)
    await until(lambda: len(failures) >= 2)
    before = len(site.driven)
    await until(lambda: len(site.driven) > before + 10)

    assert not site.task.done()


async def test_when_it_ends_the_base_is_told_to_rest(site: Site) -> None:
    await until(lambda: site.driven)
    before = len(site.driven)
    site.task.cancel()
    await asyncio.gather(site.task, return_exceptions=True)

    assert len(site.driven) > before
    assert site.driven[-1] == ros.Twist()
