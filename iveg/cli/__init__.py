"""Command line: arguments and settings → parts (docs/interfaces/cli.md)."""

import logging
import os
import sys
from collections.abc import Sequence
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
_UNUSABLE_ERRORS = SettingsError, DataFileError, MissingExtraError


def main(arguments: Sequence[str]) -> int:
    """Run one command; returns the exit code."""
    # Commands of the product, and of the laboratory where it is installed.
    laboratory = find_laboratory("commands")
    commands = COMMANDS if laboratory is None else (*COMMANDS, *laboratory.COMMANDS)
    options = parser(commands).parse_args(arguments)
    logging.basicConfig(
        level=logging.INFO if options.verbose else logging.WARNING,
        format="%(asctime)s %(levelname)s %(name)s: %(message)s",
    )
    # These log every request at INFO; their important events are warnings.
    for noisy in ("httpx", "httpx2", "alembic"):
        logging.getLogger(noisy).setLevel(logging.WARNING)
    try:
        settings = Settings.from_environment(os.environ)
        if old_names := sorted(name for name in GONE if os.environ.get(name)):
            text = "%s: no longer a setting (docs/upgrading.md)"
            _log.warning(text, ", ".join(old_names))
        data = settings.data_directory or default_data_directory(
            os.environ, Path.home()
        )
        call = CommandCall(options, settings, os.environ, Path(data))
        code: int = import_module(options.module).run(call)
    except IvegError as error:
        print(f"iveg: {error}", file=sys.stderr)
        return UNUSABLE if isinstance(error, _UNUSABLE_ERRORS) else 1
    return code


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

    The only import of ``iveg.lab`` by the product: the server's image lacks it.
    """
    module = f"iveg.lab.{part}"
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name in ("iveg.lab", module):
            return None
        raise
