"""``iveg replay``: plays recorded logs as robots, never under a live robot's name."""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from iveg.adapters.fleet_files import load_fleet
from iveg.cli.arguments import CommandCall
from iveg.cli.nodes import broker_of, node_settings
from iveg.cli.running import LOOPBACK, run_until_stopped
from iveg.domain.errors import DataFileError
from iveg.domain.fleet import FleetDescription
from iveg.robot.replay.replay import ReplaySettings, run_replay
from iveg.settings import Settings


def run(call: CommandCall) -> int:
    """Run ``iveg replay``; returns the exit code."""
    work = replay(call.options, call.settings)
    return run_until_stopped(work, until_eof=call.options.until_eof)


async def replay(options: argparse.Namespace, settings: Settings) -> None:
    """Play recorded logs of real robots as robots."""
    fleet = load_fleet(settings.fleet, settings.robots)
    _refuse_replay(options, settings, fleet)
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


def _refuse_replay(
    options: argparse.Namespace, settings: Settings, fleet: FleetDescription
) -> None:
    """Refuse a replay that could be taken for a live robot."""
    for name in options.robot:
        if name not in fleet.members:
            reason = f"is not in the fleet (IVEG_ROBOTS: {', '.join(fleet.ids)})"
            raise DataFileError("--robot", name, reason)
        if fleet.of_robot(name).kind == "live":
            reason = f"is a live robot of the fleet; {name}:recording in IVEG_ROBOTS"
            raise DataFileError("--robot", name, f"{reason} makes it a recording")
    host = broker_of(settings).host
    if host not in LOOPBACK and not options.force:
        raise DataFileError(
            "IVEG_MQTT_URL", host, "is not on loopback; --force if that is meant"
        )
