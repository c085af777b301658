"""``iveg replay``: recorded logs as robots, whose names no live robot may have."""

import argparse
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

from iveg.adapters import clock
from iveg.adapters.fleet_files import load_fleet
from iveg.app.outside import open_fiware
from iveg.cli.arguments import CommandCall
from iveg.cli.nodes import broker_of, node_settings
from iveg.cli.running import LOOPBACK, run_until_stopped
from iveg.domain.errors import DataFileError
from iveg.domain.fleet import FleetDescription
from iveg.robot.replay.replay import ReplaySettings, run_replay
from iveg.settings import Settings

_LIVE_S = 10.0


async def live_robot(settings: Settings, robots: Iterable[str]) -> str | None:
    """The first of these robots that Orion had data of in the last 10 s.

    Raises:
        HopError: Orion does not answer.
    """
    orion, agent = open_fiware(settings)
    async with orion, agent:
        for robot_id in robots:
            modified = await orion.modified_at(robot_id)
            if modified is not None and clock.wall() - modified < _LIVE_S:
                return robot_id
    return None


def run(call: CommandCall) -> int:
    """Run ``iveg replay``; returns the exit code."""
    work = replay(call.options, call.settings)
    return run_until_stopped(work, until_eof=call.options.until_eof)


async def replay(options: argparse.Namespace, settings: Settings) -> None:
    """Recorded logs of real robots, replayed as robots."""
    fleet = load_fleet(settings.fleet, settings.robots)
    await _refuse_replay(options, settings, fleet)
    with TemporaryDirectory(prefix="iveg-replay-") as directory:
        await run_replay(
            options.files,
            options.robot,
            ReplaySettings(
                node_settings(settings, Path(directory)),
                options.speed,
                options.loop,
                options.frame,
            ),
            fleet=fleet,
            named={
                "odometry": options.odom_topic,
                "scan": options.scan_topic,
                "detections": options.detections_topic,
            },
        )


async def _refuse_replay(
    options: argparse.Namespace, settings: Settings, fleet: FleetDescription
) -> None:
    """Refuse a replay that could be taken for a live robot."""
    for name in options.robot:
        if name not in fleet.members:
            known = ", ".join(fleet.ids)
            reason = f"is not in the fleet (IVEG_ROBOTS: {known})"
            raise DataFileError("--robot", name, reason)
        if fleet.of_robot(name).kind == "live":
            reason = f"is a live robot of the fleet; {name}:recording in IVEG_ROBOTS"
            raise DataFileError("--robot", name, f"{reason} makes it a recording")
    if options.force:
        return
    host = broker_of(settings).host
    if host not in LOOPBACK:
        raise DataFileError(
            "IVEG_MQTT_URL", host, "is not on loopback; --force if that is meant"
        )
    live = await live_robot(settings, options.robot)
    if live is not None:
        raise DataFileError(
            "--robot", live, "was live in the last 10 s; --force if meant"
        )
