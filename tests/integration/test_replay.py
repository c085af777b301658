"""Recorded runs played as robots on a real broker."""

import asyncio
import logging
from pathlib import Path

import pytest

from iveg.adapters.mqtt import BrokerAddress
from iveg.domain.errors import DataFileError
from iveg.domain.observations import (
    DetectionFrame,
    LaserScan,
    Navigation,
    Odometry,
    SafetyReport,
)
from iveg.ngsi import codec
from iveg.robot.node import NodeSettings
from iveg.robot.replay.replay import ReplaySettings, run_replay
from tests import data
from tests.integration.emulator_cloud import Cloud, running, until

AISLE = Path(data.__file__).parent / "aisle.jsonl"


def of_run(address: BrokerAddress, folder: Path, speed: float = 1.0) -> ReplaySettings:
    node = NodeSettings(address=address, apikey="iveg", directory=folder)
    return ReplaySettings(node, speed, loop=False)


def farthest(cloud: Cloud) -> float:
    return max((o.pose.x for o in cloud.of("AGI", Odometry)), default=-1.0)


async def test_a_log_is_played_to_its_end_and_the_robot_then_stands(
    address: BrokerAddress,
    cloud: Cloud,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    with caplog.at_level(logging.WARNING):
        async with asyncio.timeout(30.0):
            await run_replay([AISLE], ["AGI"], of_run(address, tmp_path, 4.0))

    last = cloud.of("AGI", Odometry)[-20:]
    people = [d for f in cloud.of("AGI", DetectionFrame) for d in f.detections]
    assert farthest(cloud) == pytest.approx(4.0, abs=0.05)
    assert {(o.pose.x, o.twist.linear_x) for o in last} == {(0.0, 0.0)}
    assert {o.task for o in cloud.of("AGI", Navigation)} == {"replay"}
    assert {o.origin.replay for o in cloud.of("AGI", SafetyReport)} == {"AGI"}
    assert {o.origin.replay for o in cloud.of("AGI", LaserScan)} == {"AGI"}
    assert {(d.class_id, d.frame_id) for d in people} == {("farmer", "map")}
    assert cloud.of("AGI", DetectionFrame)[-1].detections == ()
    assert cloud.of("AGI", LaserScan)[0].mount.x == 0.1
    assert cloud.problems == []
    assert caplog.records == []


async def test_a_stop_pauses_the_log_and_the_robot_reports_standing(
    address: BrokerAddress, cloud: Cloud, tmp_path: Path
) -> None:
    played = run_replay([AISLE], ["AGI"], of_run(address, tmp_path))
    async with running(asyncio.create_task(played)):
        await until(lambda: farthest(cloud) > 0.3)

        await cloud.command("AGI", codec.StopOrder("01STOP", "anna"))
        await until(lambda: cloud.speed("AGI") == 0.0)
        stood = cloud.of("AGI", Odometry)[-1].pose
        count = len(cloud.of("AGI", Odometry))
        await until(lambda: len(cloud.of("AGI", Odometry)) > count + 20)

        assert cloud.of("AGI", Odometry)[-1].pose == stood
        assert [hold.id for hold in cloud.report("AGI").holds] == ["01STOP"]

        challenge = cloud.report("AGI").challenge or ""
        await cloud.command("AGI", codec.ReleaseOrder(challenge, "01T", ("01STOP",)))
        await until(lambda: not cloud.report("AGI").holds)
        challenge = cloud.report("AGI").challenge or ""
        await cloud.command("AGI", codec.ResumeOrder(challenge, "01U"))
        await until(lambda: cloud.of("AGI", Odometry)[-1].pose.x > stood.x + 0.3)


@pytest.mark.parametrize(
    ("files", "robots", "why"),
    [
        ((AISLE,), ("AGI", "AGII"), "1 files for 2 robots"),
        ((AISLE, AISLE), ("AGI", "AGI"), "named twice"),
        ((Path("gone.jsonl"),), ("AGI",), "cannot be read"),
    ],
)
async def test_what_cannot_be_played_is_refused_with_one_sentence(
    tmp_path: Path, files: tuple[Path, ...], robots: tuple[str, ...], why: str
) -> None:
    nobody = of_run(BrokerAddress("127.0.0.1", 1), tmp_path)
    with pytest.raises(DataFileError, match=why):
        await run_replay(files, robots, nobody)
