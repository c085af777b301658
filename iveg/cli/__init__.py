"""Command line: arguments and settings to parts (docs/interfaces/cli.md)."""

import argparse
import logging
import os
import sys
from collections.abc import Coroutine, Sequence
from pathlib import Path
from typing import Any

from iveg.cli.arguments import parser
from iveg.domain.errors import (
    DataFileError,
    IvegError,
    MissingExtraError,
    SettingsError,
)
from iveg.settings import Settings, default_data_directory, describe

UNUSABLE = 2
"""Exit code for a setting or a file that cannot be used."""


def main(arguments: Sequence[str]) -> int:
    """Run one command; returns the exit code."""
    options = parser().parse_args(arguments)
    logging.basicConfig(
        level=logging.INFO if options.verbose else logging.WARNING,
        format="%(asctime)s %(levelname)s %(name)s: %(message)s",
    )
    # They log every message at INFO; important events are warnings.
    for noisy in ("amqtt", "transitions", "httpx", "alembic"):
        logging.getLogger(noisy).setLevel(logging.WARNING)
    try:
        settings = Settings.from_environment(os.environ)
        return _run(options, settings)
    except (SettingsError, DataFileError, MissingExtraError) as error:
        print(f"iveg: {error}", file=sys.stderr)
        return UNUSABLE
    except IvegError as error:
        print(f"iveg: {error}", file=sys.stderr)
        return 1


def _run(options: argparse.Namespace, settings: Settings) -> int:
    data = Path(
        settings.data_directory or default_data_directory(os.environ, Path.home())
    )
    match options.command:
        case "settings":
            print(describe(), end="")
            return 0
        case "db":
            from iveg.cli.serve import upgrade_database

            return upgrade_database(settings, data)
        case "provision":
            from iveg.cli.provision import provision_fleet

            return provision_fleet(settings)
        case "doctor":
            from iveg.cli.doctor import run_doctor

            return run_doctor(settings, data)
        case "robot":
            from iveg.cli.robot import run_robot

            return run_robot(options, settings, data, os.environ)
        case "experiment":
            from iveg.cli.experiment import experiment

            return experiment(options, settings, os.environ, data)
        case "demo":
            from iveg.cli.demo import demo

            emulator = not options.no_emulator
            return demo(
                settings, os.environ, data, emulator=emulator, ros2=options.ros2
            )
        case _:
            from iveg.cli.running import run_until_stopped

            work = _part(options, settings, data)
            return run_until_stopped(work, until_eof=options.until_eof)


def _part(
    options: argparse.Namespace, settings: Settings, data: Path
) -> Coroutine[Any, Any, None]:
    """A part as a process; FIWARE and robots start without the page's libraries."""
    match options.command:
        case "serve":
            from iveg.cli.serve import serve

            data.mkdir(parents=True, exist_ok=True)
            return serve(settings, data, demo=options.demo)
        case "fiware":
            from iveg.cli.fiware import fiware

            return fiware(settings)
        case "emulator":
            from iveg.cli.emulator import emulator

            return emulator(options, settings)
        case _:
            from iveg.cli.replay import replay

            return replay(options, settings)
