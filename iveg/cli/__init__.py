"""Command line: arguments and settings to parts (docs/interfaces/cli.md)."""

import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from iveg.app.laboratory import find_laboratory
from iveg.cli.arguments import (
    CommandCall,
    CommandWord,
    add_audit,
    add_db,
    add_export,
    add_incident,
    add_replay,
    add_robot,
    add_serve,
    add_user,
    parser,
)
from iveg.cli.running import run_until_stopped
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
        data = settings.data_directory or default_data_directory(
            os.environ, Path.home()
        )
        code: int = options.run(CommandCall(options, settings, os.environ, Path(data)))
    except (SettingsError, DataFileError, MissingExtraError) as error:
        print(f"iveg: {error}", file=sys.stderr)
        return UNUSABLE
    except IvegError as error:
        print(f"iveg: {error}", file=sys.stderr)
        return 1
    return code


def _commands() -> Sequence[CommandWord]:
    """Commands of the product, and of the laboratory where it is installed."""
    laboratory = find_laboratory("commands")
    return COMMANDS if laboratory is None else (*COMMANDS, *laboratory.COMMANDS)


# Each command imports what it needs when it runs: a robot starts without the libraries
# of page and history.


def _serve(call: CommandCall) -> int:
    from iveg.cli.serve import serve

    call.data.mkdir(parents=True, exist_ok=True)
    work = serve(call.settings, call.data, demo=call.options.demo)
    return run_until_stopped(work, until_eof=call.options.until_eof)


def _replay(call: CommandCall) -> int:
    from iveg.cli.replay import replay

    work = replay(call.options, call.settings)
    return run_until_stopped(work, until_eof=call.options.until_eof)


def _robot(call: CommandCall) -> int:
    from iveg.cli.robot import run_robot

    return run_robot(call.options, call.settings, call.data, call.environment)


def _provision(call: CommandCall) -> int:
    from iveg.cli.provision import provision_fleet

    return provision_fleet(call.settings)


def _doctor(call: CommandCall) -> int:
    from iveg.cli.doctor import run_doctor

    return run_doctor(call.settings, call.data)


def _settings(_: CommandCall) -> int:
    print(describe(), end="")
    return 0


def _db(call: CommandCall) -> int:
    from iveg.cli.database import run_db

    return run_db(call.options, call.settings, call.data)


def _incident(call: CommandCall) -> int:
    from iveg.cli.incident import run_incident

    return run_incident(call.options)


def _export(call: CommandCall) -> int:
    from iveg.cli.export import run_export

    return run_export(call.options, call.settings, call.data)


def _audit(call: CommandCall) -> int:
    from iveg.cli.audit import run_audit

    return run_audit(call.options, call.settings, call.data)


def _user(call: CommandCall) -> int:
    from iveg.cli.user import run_user

    return run_user(call.options, call.settings, call.data)


COMMANDS = (
    CommandWord("serve", "the DSS and its page", _serve, add_serve),
    CommandWord("replay", "recorded logs as robots", _replay, add_replay),
    CommandWord("robot", "a ROS 2 robot joins", _robot, add_robot),
    CommandWord("provision", "make devices and subscriptions", _provision),
    CommandWord("doctor", "try every hop once and say what is broken", _doctor),
    CommandWord("settings", "print docs/settings.md", _settings),
    CommandWord("db", "the history's database", _db, add_db),
    CommandWord("export", "a list of the history as a file", _export, add_export),
    CommandWord("incident", "verify an incident pack", _incident, add_incident),
    CommandWord("user", "who may sign in", _user, add_user),
    CommandWord("audit", "whether the audit is whole", _audit, add_audit),
)
