"""Simulated robots as a process."""

import argparse
import os
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from iveg.adapters.equipment_files import DEMO
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.cli.arguments import CommandCall
from iveg.cli.nodes import node_settings
from iveg.cli.running import report_ready, run_until_stopped, tune_garbage_collection
from iveg.domain.laser import Plan
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.fleet import FleetSettings, SimulatedFleet
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import SimulatedWorld
from iveg.settings import Settings

if TYPE_CHECKING:
    from iveg.adapters.dds import Dds


def run(call: CommandCall) -> int:
    """Run ``iveg emulator``; returns the exit code."""
    work = emulator(call.options, call.settings)
    return run_until_stopped(work, until_eof=call.options.until_eof)


async def emulator(options: argparse.Namespace, settings: Settings) -> None:
    """Simulated robots, people and climate."""
    tune_garbage_collection()
    fleet = load_fleet(settings.fleet, settings.robots)
    members = fleet.members.values()
    robots = [member.robot_id for member in members if member.kind == "live"]
    if options.robots is not None:
        numbers = range(len(robots) + 1, options.robots + 1)
        robots = [*robots, *(f"AG{number}" for number in numbers)][: options.robots]
    with (
        TemporaryDirectory(prefix="iveg-robots-") as directory,
        _network(options) as network,
    ):
        greenhouse = load_greenhouse(settings.greenhouse)
        layout = lay_out(scenario_named(options.scenario), robots, greenhouse, fleet)
        detector = DETECTORS[options.profile]
        emulated = SimulatedFleet(
            SimulatedWorld(greenhouse, layout, detector, options.seed),
            FleetSettings(
                node_settings(
                    settings, Path(directory), Plan.from_greenhouse(greenhouse)
                ),
                options.held,
                options.hz,
                has_equipment=settings.equipment == DEMO,
            ),
            network,
        )
        report_ready()
        await emulated.run()


def _network(options: argparse.Namespace) -> "AbstractContextManager[Dds | None]":
    """DDS for robots that speak ROS 2, if requested."""
    if not options.dds:
        return nullcontext()
    from iveg.cli.nodes import load_config, network_of

    config = load_config(options, os.environ)
    network = network_of(config, os.environ, "iveg emulator --dds")
    from iveg.adapters.dds import Dds

    return Dds(network)
