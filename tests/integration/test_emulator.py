"""The emulated fleet on a real broker, with a small iVeg that hears and answers."""

import asyncio
import logging
from pathlib import Path

import pytest

from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.mqtt import BrokerAddress
from iveg.domain.observations import (
    DetectionFrame,
    LaserScan,
    Navigation,
    Odometry,
)
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.fleet import FleetSettings, SimulatedFleet
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import SimulatedWorld
from iveg.robot.node import NodeSettings
from tests.integration.emulator_cloud import Cloud, running, until

TESTBED = load_greenhouse("mvsim-20x20")
FLEET = ("AGI", "AGII")


def emulator(address: BrokerAddress, folder: Path) -> asyncio.Task[None]:
    layout = lay_out(scenario_named("nlos"), FLEET, TESTBED)
    node = NodeSettings(address=address, apikey="iveg", directory=folder / "state")
    world = SimulatedWorld(TESTBED, layout, DETECTORS["perfect"], seed=1)
    fleet = SimulatedFleet(world, FleetSettings(node))
    return asyncio.create_task(fleet.run())


async def test_robots_publish_all_that_the_contract_names_in_order_and_cleanly(
    address: BrokerAddress,
    cloud: Cloud,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    said = ["odom", "lidar2D", "yolox_bounding_boxes", "safety", "nav", "battery"]
    wanted = {f"{robot_id}_{one}" for robot_id in FLEET for one in said}
    with caplog.at_level(logging.WARNING):
        async with running(emulator(address, tmp_path)):
            await until(lambda: len(cloud.of("AGII", Odometry)) > 45)
            await until(lambda: cloud.newest("AGII", Navigation))
            await until(lambda: cloud.devices >= wanted)

    counted = [o.origin.seq or 0 for o in cloud.of("AGII", Odometry)]
    scans, looks = cloud.of("AGII", LaserScan), cloud.of("AGII", DetectionFrame)
    assert cloud.devices == wanted | {"climate"}
    assert cloud.problems == []
    assert counted == sorted(set(counted))
    assert 0.5 < len(scans) / len(counted) < 2.0
    assert 0.5 < len(looks) / len(counted) < 2.0
    assert caplog.records == []
