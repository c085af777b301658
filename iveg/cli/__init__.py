"""Command line: arguments and settings to parts (docs/interfaces/cli.md)."""

import logging
import os
import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType

from iveg.cli.arguments import (
    CommandCall,
    CommandWord,
    add_db,
    add_export,
    add_replay,
    add_robot,
    add_serve,
    add_user,
    parser,
)
from iveg.domain.errors import (
    DataFileError,
    IvegError,
    MissingExtraError,
    SettingsError,
)
from iveg.settings import GONE, Settings, default_data_directory

_log = logging.getLogger(__name__)
UNUSABLE = 2
"""Exit code for a setting or a file that cannot be used."""


def main(arguments: Sequence[str]) -> int:
    """Run one command; returns the exit code."""
    options = parser(_commands()).parse_args(arguments)
    logging.basicConfig(
        level=logging.INFO if options.verbose else logging.WARNING,
        format="%(asctime)s %(levelname)s %(name)s: %(message)s",
    )
    # They log every message at INFO; important events are warnings.
    for noisy in ("httpx", "alembic"):
        logging.getLogger(noisy).setLevel(logging.WARNING)
    try:
        settings = Settings.from_environment(os.environ)
        _warn_of_gone(os.environ)
        data = settings.data_directory or default_data_directory(
            os.environ, Path.home()
        )
        call = CommandCall(options, settings, os.environ, Path(data))
        code: int = import_module(options.module).run(call)
    except (SettingsError, DataFileError, MissingExtraError) as error:
        print(f"iveg: {error}", file=sys.stderr)
        return UNUSABLE
    except IvegError as error:
        print(f"iveg: {error}", file=sys.stderr)
        return 1
    return code


def _warn_of_gone(environment: Mapping[str, str]) -> None:
    """Name settings that no version has any more, in one warning."""
    gone = sorted(name for name in GONE if environment.get(name))
    if gone:
        _log.warning("%s: no longer a setting (docs/upgrading.md)", ", ".join(gone))


def _commands() -> Sequence[CommandWord]:
    """Commands of the product, and of the laboratory where it is installed."""
    laboratory = find_laboratory("commands")
    return COMMANDS if laboratory is None else (*COMMANDS, *laboratory.COMMANDS)


COMMANDS = (
    CommandWord("serve", "the DSS and its page", "iveg.cli.serve", add_serve),
    CommandWord("replay", "recorded logs as robots", "iveg.cli.replay", add_replay),
    CommandWord("robot", "a ROS 2 robot joins", "iveg.cli.robot", add_robot),
    CommandWord("provision", "make devices and subscriptions", "iveg.cli.provision"),
    CommandWord(
        "doctor", "try every hop once and say what is broken", "iveg.cli.doctor"
    ),
    CommandWord("settings", "print docs/settings.md", "iveg.cli.settings"),
    CommandWord("db", "the history's database", "iveg.cli.database", add_db),
    CommandWord(
        "export", "a list of the history as a file", "iveg.cli.export", add_export
    ),
    CommandWord("user", "who may sign in", "iveg.cli.user", add_user),
)


def find_laboratory(part: str) -> ModuleType | None:
    """A module of the laboratory by its name; None where there is no laboratory.

    The one door: nothing of the product imports ``iveg.lab``, which an image lacks.
    """
    module = f"iveg.lab.{part}"
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name in ("iveg.lab", module):
            return None
        raise
