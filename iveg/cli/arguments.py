"""Commands and their arguments (docs/interfaces/cli.md)."""

import argparse
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from iveg import __version__
from iveg.domain.fleet import is_robot_id
from iveg.domain.records import LISTS
from iveg.settings import Settings

AddArguments = Callable[[argparse.ArgumentParser], None]


@dataclass(frozen=True, slots=True)
class CommandCall:
    """Call of the command line.

    Attributes:
        options: Parsed arguments.
        environment: Variables of the process, from which the settings were read.
        data: Data directory.
    """

    options: argparse.Namespace
    settings: Settings
    environment: Mapping[str, str]
    data: Path


@dataclass(frozen=True, slots=True)
class CommandWord:
    """Command of the command line.

    Attributes:
        help: Its line in ``iveg --help``.
        module: Module whose ``run`` executes a call and returns the exit code.  A call
            imports it: a robot starts without the libraries of page and history.
        add_arguments: Adds its arguments to its parser.
    """

    name: str
    help: str
    module: str
    add_arguments: AddArguments | None = None


def parser(commands: Iterable[CommandWord]) -> argparse.ArgumentParser:
    """Parser of these commands, in the order of ``iveg --help``."""
    parser = argparse.ArgumentParser(
        prog="iveg", description="Supervise mixed robot fleets in greenhouses."
    )
    parser.add_argument("--version", action="version", version=f"iveg {__version__}")
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="log what goes well, too"
    )
    words = parser.add_subparsers(dest="command", required=True)
    for command in commands:
        word = words.add_parser(command.name, help=command.help)
        if command.add_arguments is not None:
            command.add_arguments(word)
        word.set_defaults(module=command.module)
    return parser


def add_serve(serve: argparse.ArgumentParser) -> None:
    """Arguments of ``iveg serve``."""
    serve.add_argument("--demo", action="store_true", help=argparse.SUPPRESS)
    add_end(serve)


def add_db(database: argparse.ArgumentParser) -> None:
    """Arguments of ``iveg db``."""
    actions = database.add_subparsers(dest="action", required=True)
    actions.add_parser("upgrade", help="to the newest schema")


def add_export(export: argparse.ArgumentParser) -> None:
    """Arguments of ``iveg export``."""
    export.add_argument("list", choices=list(LISTS), help="of the history")
    for end in ("since", "until"):
        export.add_argument(f"--{end}", metavar="MOMENT", help="ISO-8601")
    export.add_argument("--robot", metavar="ID", help="of this robot alone")
    export.add_argument("--format", choices=("csv", "ndjson"), default="csv")
    export.add_argument("--out", type=Path, metavar="FILE", help="else to the output")


def add_user(user: argparse.ArgumentParser) -> None:
    """Arguments of ``iveg user``."""
    actions = user.add_subparsers(dest="action", required=True)
    actions.add_parser("list", help="names, roles and states")
    for action, text in {
        "add": "a person, with a link that works once",
        "reset": "take the password away, and print a new link",
        "disable": "sign them out everywhere, for good",
    }.items():
        words = actions.add_parser(action, help=text)
        words.add_argument("name", metavar="NAME")
        if action == "add":
            roles = ("viewer", "operator", "admin")
            words.add_argument("--role", choices=roles, required=True)
            ends = "how long it is good for"
            words.add_argument("--days", type=int, metavar="N", help=ends)


def add_replay(replay: argparse.ArgumentParser) -> None:
    """Arguments of ``iveg replay``."""
    replay.add_argument("files", nargs="+", type=Path, metavar="FILE")
    replay.add_argument(
        "--robot",
        nargs="+",
        action="extend",
        required=True,
        metavar="NAME",
        help="one for each file, in their order; may be repeated",
    )
    replay.add_argument("--speed", type=_speed, default=1.0, metavar="FACTOR")
    replay.add_argument("--loop", action="store_true", help="start over at the end")
    for data in ("odom", "scan", "detections"):
        replay.add_argument(f"--{data}-topic", metavar="TOPIC", help="of a ROS bag")
    replay.add_argument(
        "--frame",
        type=_frame,
        metavar="NAME",
        help="map that the recordings share, such as `shared` (default: each its own)",
    )
    replay.add_argument(
        "--force", action="store_true", help="also on a broker that is not on loopback"
    )
    add_end(replay)


def add_robot(robot: argparse.ArgumentParser) -> None:
    """Arguments of ``iveg robot``."""
    robot.add_argument("action", nargs="?", choices=("run", "check"), default="run")
    robot.add_argument("--id", required=True, metavar="ROBOT", help="as iVeg knows it")
    robot.add_argument("--config", type=Path, metavar="robot.toml")
    robot.add_argument(
        "--greenhouse",
        metavar="NAME|FILE",
        help="what stands around it, for its laser; else only its own path counts",
    )
    robot.add_argument("--namespace", metavar="/NAME", help="of its relative topics")
    robot.add_argument("--cmd-vel-in", metavar="TOPIC", help="what navigation wishes")
    robot.add_argument("--cmd-vel-out", metavar="TOPIC", help="what the base obeys")
    robot.add_argument(
        "--sim-time", action="store_true", help="stamps are a simulator's"
    )
    robot.add_argument(
        "--attended",
        action="store_true",
        help="somebody stands at the robot and lets it go (broker on loopback only)",
    )
    add_end(robot)
    add_network(robot)


def add_network(parser: argparse.ArgumentParser) -> None:
    """Options for the ROS 2 network."""
    parser.add_argument("--ros-domain", type=int, metavar="N", help="0 to 232")
    parser.add_argument("--ros-interface", metavar="NAME", help="or its address")
    parser.add_argument(
        "--ros-peer",
        nargs="+",
        metavar="ADDRESS",
        help="asked as well, where multicast does not pass",
    )


def add_end(parser: argparse.ArgumentParser) -> None:
    """Option of a part that ends with its parent process."""
    parser.add_argument(
        "--until-eof", action="store_true", help="end when the input closes"
    )


def _frame(text: str) -> str:
    if not is_robot_id(text):
        raise argparse.ArgumentTypeError("a name of letters, digits and hyphens")
    return text


def _speed(text: str) -> float:
    factor = float(text)
    if not 0.01 <= factor <= 100.0:
        raise argparse.ArgumentTypeError("a factor from 0.01 to 100")
    return factor
