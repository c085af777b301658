"""The emulated fleet on a real broker, with a small iVeg that hears and answers."""

import asyncio
import logging
from pathlib import Path

import httpx
import pytest

from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.mqtt import BrokerAddress
from iveg.domain.feedback import SpeedLimit
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
from tests.patience import PATIENCE_S
from tests.ports import free_ports
from tests.processes import NO_TLS

TESTBED = load_greenhouse("mvsim-20x20")
FLEET = ("AGI", "AGII")


async def post(port: int, order: object) -> httpx.Response:
    """Send an order to the fault port."""
    async with httpx.AsyncClient(verify=NO_TLS, timeout=PATIENCE_S) as client:
        return await client.post(f"http://127.0.0.1:{port}/", json=order)


def emulator(
    address: BrokerAddress, folder: Path, port: int | None = None
) -> asyncio.Task[None]:
    layout = lay_out(scenario_named("nlos"), FLEET, TESTBED)
    node = NodeSettings(address=address, apikey="iveg", directory=folder / "state")
    world = SimulatedWorld(TESTBED, layout, DETECTORS["perfect"], seed=1)
    fleet = SimulatedFleet(world, FleetSettings(node))
    work = fleet.run() if port is None else fleet.run_with_faults(port)
    return asyncio.create_task(work)


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


async def test_faults_are_done_as_ordered_and_holds_bite_a_deaf_robot(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    (port,) = free_ports(1)
    async with running(emulator(address, tmp_path, port)):
        await until(lambda: cloud.speed("AGII") > 0.5)

        done = await post(port, {"robot": "AGII", "local_hold": "hw"})
        assert done.status_code == 204
        await until(lambda: [h.source for h in cloud.report("AGII").holds] == ["hw"])
        await post(port, {"robot": "AGII", "release_locally": True})
        await until(lambda: not cloud.report("AGII").holds)

        # Deaf, it drives on whatever its gate says.
        cloud.speed_limits["AGII"] = SpeedLimit(0.5, "person", "someone", 1.0)
        await until(lambda: cloud.report("AGII").speed_factor == 0.5)
        await post(port, {"robot": "AGII", "deaf": True})
        await until(lambda: cloud.speed("AGII") > 0.6)
        assert cloud.report("AGII").speed_factor == 0.5

        await cloud.command("AGII", {"stop": {"id": "01STOP", "by": "anna"}})
        await until(lambda: cloud.speed("AGII") == 0.0)
