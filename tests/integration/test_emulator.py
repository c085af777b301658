"""The emulated fleet on a real broker, with a small iVeg that hears and answers."""

import asyncio
import itertools
import json
import logging
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

import httpx
import pytest

from iveg.adapters import clock
from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.errors import DataFileError, SettingsError
from iveg.domain.feedback import SpeedLimit
from iveg.domain.observations import (
    CommandAnswer,
    DetectionFrame,
    LaserScan,
    Navigation,
    Odometry,
    SafetyReport,
)
from iveg.lab.emulator.detector_model import DETECTORS
from iveg.lab.emulator.emulated_robot import FleetSettings
from iveg.lab.emulator.fleet import SimulatedFleet, run_emulator
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.scripts import Incident
from iveg.lab.emulator.world import SimulatedWorld
from iveg.ngsi import codec
from iveg.robot.node_settings import NodeSettings
from tests.integration.emulator_cloud import Cloud, broker, running, until
from tests.processes import NO_TLS

TESTBED = load_greenhouse("mvsim-20x20")
FLEET = ("AGI", "AGII")


@pytest.fixture
async def address(tmp_path: Path) -> AsyncIterator[BrokerAddress]:
    async with broker(tmp_path) as where:
        yield where


@pytest.fixture
async def cloud(address: BrokerAddress) -> AsyncIterator[Cloud]:
    small = Cloud(address)
    async with running(asyncio.create_task(small.run())):
        await until(lambda: small.link.connected)
        yield small


class FaultPort:
    """Speaks to the fault port."""

    def __init__(self) -> None:
        self.port = 0

    def opened(self, port: int) -> None:
        self.port = port

    async def post(self, order: object, *, method: str = "POST") -> httpx.Response:
        async with httpx.AsyncClient(verify=NO_TLS) as client:
            url = f"http://127.0.0.1:{self.port}/"
            return await client.request(method, url, content=json.dumps(order))


def of_run(
    address: BrokerAddress, folder: Path, *, held: bool = False
) -> FleetSettings:
    node = NodeSettings(address=address, apikey="iveg", directory=folder)
    return FleetSettings(node, held=held)


def emulator(
    address: BrokerAddress,
    folder: Path,
    *,
    scenario: str = "nlos",
    robots: tuple[str, ...] = FLEET,
    held: bool = False,
    faults: Sequence[FaultOrder] = (),
    port: FaultPort | None = None,
) -> asyncio.Task[None]:
    return asyncio.create_task(
        run_emulator(
            robots,
            TESTBED,
            of_run(address, folder / "state", held=held),
            scenario=scenario,
            profile="perfect",
            faults=faults,
            fault_port=None if port is None else 0,
            on_fault_port=(port or FaultPort()).opened,
        )
    )


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


async def test_the_crew_releases_at_start_and_the_robot_obeys_a_speed_limit(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    async with running(emulator(address, tmp_path)):
        await until(lambda: cloud.speed("AGII") > 0.7)

        cloud.speed_limits["AGII"] = SpeedLimit(0.5, "person", "someone", 1.2)
        await until(lambda: 0.2 < cloud.speed("AGII") < 0.45)

        assert cloud.report("AGII").speed_factor == 0.5


async def test_robots_that_nobody_releases_stay_held(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    async with running(emulator(address, tmp_path, held=True)):
        await until(lambda: len(cloud.of("AGII", Odometry)) > 60)

        assert [hold.source for hold in cloud.report("AGII").holds] == ["boot"]
        assert max(o.twist.linear_x for o in cloud.of("AGII", Odometry)) == 0.0


async def test_a_stopped_robot_stands_and_drives_again_after_release_and_resume(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    async with running(emulator(address, tmp_path)):
        await until(lambda: cloud.speed("AGII") > 0.5)

        await cloud.command("AGII", {"stop": {"id": "01STOP", "by": "anna"}})
        await until(lambda: cloud.newest("AGII", CommandAnswer))
        await until(lambda: cloud.speed("AGII") < 0.001)
        assert [hold.id for hold in cloud.report("AGII").holds] == ["01STOP"]

        challenge = cloud.report("AGII").challenge
        await cloud.command(
            "AGII", codec.write_release(["01STOP"], challenge or "", "01T")
        )
        await until(lambda: not cloud.report("AGII").holds)
        assert cloud.speed("AGII") < 0.001

        challenge = cloud.report("AGII").challenge
        await cloud.command("AGII", codec.write_resume(challenge or "", "01U"))
        await until(lambda: cloud.speed("AGII") > 0.5)


async def test_without_feedback_the_robots_come_to_a_stand(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    async with running(emulator(address, tmp_path)):
        await until(lambda: cloud.speed("AGII") > 0.5)

        cloud.speaks = False
        await until(lambda: cloud.report("AGII").holds)
        await until(lambda: cloud.speed("AGII") < 0.001)

        assert [hold.source for hold in cloud.report("AGII").holds] == ["link"]


async def test_faults_are_done_as_ordered(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    port = FaultPort()
    async with running(emulator(address, tmp_path, port=port)):
        await until(lambda: cloud.speed("AGII") > 0.5)

        done = await port.post({"robot": "AGII", "local_hold": "hw"})
        assert done.status_code == 204
        await until(lambda: [h.source for h in cloud.report("AGII").holds] == ["hw"])
        await port.post({"robot": "AGII", "release_locally": True})
        await until(lambda: not cloud.report("AGII").holds)
        await until(lambda: cloud.speed("AGII") > 0.5)

        await port.post({"robot": "AGII", "kill": True})
        before = cloud.report("AGII").origin.boot
        await port.post({"robot": "AGII", "revive": True})
        await until(lambda: cloud.report("AGII").origin.boot != before)
        assert [h.source for h in cloud.report("AGII").holds] == ["boot"]


async def until_scans(cloud: Cloud, more: int) -> None:
    """Until so many more scans of AGII have come."""
    had = len(cloud.of("AGII", LaserScan))
    await until(lambda: len(cloud.of("AGII", LaserScan)) >= had + more)


async def test_a_mute_robot_says_nothing_and_a_frozen_one_no_odometry(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    port = FaultPort()
    async with running(emulator(address, tmp_path, port=port)):
        await until(lambda: cloud.newest("AGI", Odometry))
        await until(lambda: cloud.newest("AGII", Odometry))

        await port.post({"robot": "AGI", "mute": True})
        await port.post({"robot": "AGII", "freeze_odometry": True})
        # What was on its way when the order came is here after a third of a second.
        await until_scans(cloud, 10)
        reports, frozen = cloud.of("AGI", LaserScan), cloud.of("AGII", Odometry)
        await until_scans(cloud, 30)

        assert cloud.of("AGI", LaserScan) == reports
        assert cloud.of("AGII", Odometry) == frozen

        silent = len(cloud.of("AGI", SafetyReport))
        await port.post({"robot": "AGI", "mute": False})
        await until(lambda: len(cloud.of("AGI", SafetyReport)) > silent)


async def test_a_deaf_robot_drives_on_whatever_its_gate_says_and_holds_still_bite(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    port = FaultPort()
    cloud.speed_limits["AGII"] = SpeedLimit(0.5, "person", "someone", 1.0)
    async with running(emulator(address, tmp_path, port=port)):
        await until(lambda: cloud.speed("AGII") > 0.3)
        await port.post({"robot": "AGII", "deaf": True})
        await until(lambda: cloud.speed("AGII") > 0.6)
        assert cloud.report("AGII").speed_factor == 0.5

        await cloud.command("AGII", {"stop": {"id": "01STOP", "by": "anna"}})
        await until(lambda: cloud.speed("AGII") == 0.0)


async def test_a_person_who_was_placed_is_seen_there_and_hidden_on_demand(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    port = FaultPort()
    boxes: list[float] = []

    def seen_at(ahead: float) -> bool:
        frame = cloud.newest("AGI", DetectionFrame)
        boxes[:] = [d.box.centre[0] for d in frame.detections] if frame else []
        return len(boxes) == 1 and abs(boxes[0] - ahead) < 0.3

    def sees_nobody() -> bool:
        frame = cloud.newest("AGI", DetectionFrame)
        return frame is not None and not frame.detections

    async with running(emulator(address, tmp_path, port=port)):
        await until(lambda: cloud.newest("AGI", DetectionFrame))

        await port.post({"person": 0, "x": 10.0, "y": 8.8, "hold": True})
        await until(lambda: seen_at(5.0))
        await port.post({"robot": "AGI", "hide_people": True})
        await until(sees_nobody)
        await port.post({"robot": "AGI", "false_person": {"x": 10.0, "y": 6.8}})
        await until(lambda: seen_at(3.0))
        await port.post({"robot": "AGI", "false_person": None})
        await until(sees_nobody)


def counts_of(cloud: Cloud, robot_id: str) -> list[int]:
    return [o.origin.seq or 0 for o in cloud.of(robot_id, Odometry)]


async def test_a_bad_radio_loses_doubles_and_disorders_telemetry_alone(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    order = FaultOrder(
        robot="AGII", drop_percent=25.0, duplicate_percent=25.0, reorder_percent=25.0
    )
    async with running(emulator(address, tmp_path, faults=[order])):
        await until(lambda: len(cloud.of("AGII", Odometry)) > 150)
        await until(lambda: len(cloud.of("AGII", SafetyReport)) > 8)

    bad, good = counts_of(cloud, "AGII"), counts_of(cloud, "AGI")
    reports = [o.origin.seq or 0 for o in cloud.of("AGII", SafetyReport)]
    assert 0.6 < len(set(bad)) / (max(bad) - min(bad) + 1) < 0.9
    assert 1.05 < len(bad) / len(set(bad)) < 1.5
    assert sum(b < a for a, b in itertools.pairwise(bad)) > len(bad) / 20
    # On a busy machine a newer message replaces one that has not left yet.
    for kept in good, reports:
        assert kept == sorted(set(kept))
        assert len(kept) > 0.85 * (kept[-1] - kept[0] + 1)
    assert cloud.problems == []


async def test_a_slow_radio_brings_everything_late_and_in_order(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    port = FaultPort()

    def age() -> float:
        newest = cloud.newest("AGII", Odometry)
        return 0.0 if newest is None else clock.wall() - (newest.origin.stamp_s or 0)

    async with running(emulator(address, tmp_path, port=port)):
        await until(lambda: cloud.newest("AGII", Odometry) and age() < 0.3)

        await port.post({"robot": "AGII", "delay_ms": 700.0, "jitter_ms": 200.0})
        await until(lambda: 0.7 < age() < 1.5)
        await port.post({"robot": "AGII", "delay_ms": 0.0, "jitter_ms": 0.0})
        await until(lambda: age() < 0.3)

    counted = counts_of(cloud, "AGII")
    assert counted == sorted(counted)


async def test_odometry_that_repeats_itself_says_the_same_stamp_and_count_again(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    port = FaultPort()

    def repeats() -> int:
        counted = counts_of(cloud, "AGII")
        return counted.count(counted[-1])

    async with running(emulator(address, tmp_path, port=port)):
        await until(lambda: cloud.speed("AGII") > 0.3)

        await port.post({"robot": "AGII", "freeze_odometry": "repeat"})
        await until(lambda: repeats() > 30)
        told = {(o.origin, o.pose) for o in cloud.of("AGII", Odometry)[-20:]}
        assert len(told) == 1

        await port.post({"robot": "AGII", "freeze_odometry": False})
        await until(lambda: repeats() == 1)


async def test_a_killed_robot_comes_back_through_its_bad_radio(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    order = FaultOrder(robot="AGII", delay_ms=50.0)
    port = FaultPort()
    async with running(emulator(address, tmp_path, faults=[order], port=port)):
        await until(lambda: cloud.speed("AGII") > 0.3)

        await port.post({"robot": "AGII", "kill": True})
        killed = clock.wall()

        def since(robot_id: str) -> list[float]:
            """By when they were taken: a busy broker brings older ones later."""
            scans = cloud.of(robot_id, LaserScan)
            stamps = (one.origin.stamp_s or 0.0 for one in scans)
            return [at for at in stamps if at > killed + 0.2]

        await until(lambda: len(since("AGI")) > 30)
        assert not since("AGII")

        await port.post({"robot": "AGII", "revive": True})
        await until(lambda: len(since("AGII")) > 30)
        assert [hold.source for hold in cloud.report("AGII").holds] == ["boot"]


@pytest.mark.parametrize(
    ("order", "status", "why"),
    [
        ({"robot": "AGI", "mute": "yes"}, 400, "mute: Input should be a valid boolean"),
        ({"robot": "AGI", "explode": True}, 400, "explode: Extra inputs are not"),
        ({"robot": "AGI", "drop_percent": 101}, 400, "drop_percent: Input should be l"),
        ({"robot": "AGI", "false_person": {"x": 1.0}}, 400, "false_person.y: Field re"),
        ({"person": 0, "x": 1.0}, 400, "y: Field required"),
        ([], 400, "an order has a robot or a person"),
        ({"robot": "AGV"}, 409, "there is no robot AGV"),
        ({"person": 99, "x": 0.0, "y": 0.0}, 409, "there are 1 people, counted from 0"),
    ],
)
async def test_an_order_that_cannot_be_done_is_refused_with_a_sentence(
    address: BrokerAddress, tmp_path: Path, order: object, status: int, why: str
) -> None:
    port = FaultPort()
    async with running(emulator(address, tmp_path, port=port)):
        await until(lambda: port.port)

        refused = await port.post(order)
        read = await port.post(order, method="GET")

    assert (refused.status_code, why in refused.text) == (status, True)
    assert read.status_code == 400


async def test_the_clock_of_a_robot_can_be_wrong(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    port = FaultPort()
    async with running(emulator(address, tmp_path, port=port)):
        await until(lambda: cloud.newest("AGI", Odometry))
        right = cloud.of("AGI", Odometry)[-1].origin.stamp_s or 0.0

        await port.post({"robot": "AGI", "clock_offset_s": 3600.0})

        await until(
            lambda: (cloud.of("AGI", Odometry)[-1].origin.stamp_s or 0) > right + 3500
        )


async def test_an_incident_of_a_scenario_happens_when_it_is_due(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    layout = lay_out(scenario_named("demo"), FLEET, TESTBED)
    world = SimulatedWorld(TESTBED, layout, DETECTORS["perfect"], seed=1)
    settings = of_run(address, tmp_path)
    incidents = (
        Incident(1.0, FaultOrder(robot="AGII", mute=True)),
        Incident(0.1, FaultOrder(robot="AGV", mute=True)),
    )
    fleet = SimulatedFleet(world, settings, radio_seed=1)

    def silent_for(scans: int) -> bool:
        said = cloud.heard["AGII"]
        before = len(cloud.of("AGI", LaserScan))
        marks.append((len(said), before))
        quiet = [seen for count, seen in marks if count == len(said)]
        return bool(said) and before - quiet[0] > scans

    marks: list[tuple[int, int]] = []
    async with running(asyncio.create_task(fleet.run(incidents))):
        await until(lambda: silent_for(30))


async def test_an_unknown_profile_or_scenario_is_refused_before_anything_runs(
    address: BrokerAddress, tmp_path: Path
) -> None:
    with pytest.raises(DataFileError, match="is not one of demo, nlos"):
        await emulator(address, tmp_path, scenario="party")
    with pytest.raises(DataFileError, match="is not one of field, simulation"):
        await run_emulator(
            FLEET, TESTBED, of_run(address, tmp_path), profile="clairvoyant"
        )


async def test_a_fault_port_that_is_taken_is_refused(
    address: BrokerAddress, tmp_path: Path
) -> None:
    with pytest.raises(SettingsError, match="that nobody listens on"):
        await run_emulator(
            FLEET, TESTBED, of_run(address, tmp_path), fault_port=address.port
        )
