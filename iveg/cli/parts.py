"""The parts as processes: serve, fiware, emulator, replay.

Each is imported where it runs: FIWARE and robots start without the libraries of the
page and of the history.
"""

import argparse
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from iveg.cli.running import run_until_stopped
from iveg.settings import Settings


def run_part(options: argparse.Namespace, settings: Settings, data: Path) -> int:
    """Run one part until it is ended; returns the exit code."""
    work = _work_of(options, settings, data)
    return run_until_stopped(work, until_eof=options.until_eof)


def _work_of(
    options: argparse.Namespace, settings: Settings, data: Path
) -> Coroutine[Any, Any, None]:
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
