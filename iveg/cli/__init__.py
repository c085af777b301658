"""Command line: arguments and settings to parts (docs/interfaces/cli.md)."""

import argparse
import logging
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from iveg import __version__
from iveg.cli.arguments import (
    add_experiment_arguments,
    add_network_arguments,
    add_robot_arguments,
)
from iveg.domain.errors import (
    DataFileError,
    IvegError,
    MissingExtraError,
    SettingsError,
)
from iveg.domain.fleet import is_robot_id
from iveg.domain.geometry import Pose2D
from iveg.settings import Settings, default_data_directory, describe

UNUSABLE = 2
"""Exit code for a setting or a file that cannot be used."""
_FARTHEST_M = 1e6


def main(arguments: Sequence[str]) -> int:
    """Run one command; returns the exit code."""
    options = _parser().parse_args(arguments)
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
            from iveg.cli.parts import run_part

            return run_part(options, settings, data)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="iveg", description="Supervise mixed robot fleets in greenhouses."
    )
    parser.add_argument("--version", action="version", version=f"iveg {__version__}")
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="log what goes well, too"
    )
    commands = parser.add_subparsers(dest="command", required=True)
    demo = commands.add_parser("demo", help="everything on one machine")
    demo.add_argument(
        "--no-emulator", action="store_true", help="no robots: for `iveg replay`"
    )
    demo.add_argument(
        "--ros2", action="store_true", help="the robots speak ROS 2, as real ones do"
    )
    serve = commands.add_parser("serve", help="the DSS and its page")
    serve.add_argument("--demo", action="store_true", help=argparse.SUPPRESS)
    fiware = commands.add_parser("fiware", help="MQTT broker, Orion and IoT Agent")
    emulator = commands.add_parser("emulator", help="simulated robots")
    emulator.add_argument("--scenario", default="demo", metavar="NAME")
    emulator.add_argument(
        "--robots", type=_positive, metavar="N", help="how many (default: the fleet)"
    )
    emulator.add_argument("--seed", type=int, default=1, metavar="S")
    emulator.add_argument(
        "--profile", default="simulation", choices=("simulation", "field", "perfect")
    )
    emulator.add_argument(
        "--camera",
        default="boxes",
        choices=("boxes", "grounding"),
        help="draw boxes about the truth, or ground masks in depth pictures",
    )
    emulator.add_argument(
        "--held", action="store_true", help="robots stay held after they boot"
    )
    emulator.add_argument(
        "--hz",
        type=_rate,
        default=30.0,
        metavar="RATE",
        help="of odometry, laser and camera each (default: 30)",
    )
    emulator.add_argument(
        "--fault",
        nargs="+",
        default=[],
        metavar="[ROBOT:]FIELD=VALUE",
        help="what is wrong from the start, such as drop_percent=10 AGI:deaf=true",
    )
    emulator.add_argument(
        "--fault-port", type=int, metavar="PORT", help="take fault orders over HTTP"
    )
    emulator.add_argument(
        "--truth", type=Path, metavar="FILE", help="write down what is really in view"
    )
    emulator.add_argument(
        "--dds", action="store_true", help="they speak ROS 2, for `iveg robot`"
    )
    add_network_arguments(emulator)
    replay = commands.add_parser("replay", help="recorded logs as robots")
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
    replay.add_argument("--odom-topic", metavar="TOPIC", help="of a ROS bag")
    replay.add_argument("--scan-topic", metavar="TOPIC", help="of a ROS bag")
    replay.add_argument(
        "--bag-time",
        action="store_true",
        help="a ROS bag plays by when it was recorded, not by its stamps",
    )
    replay.add_argument(
        "--pose",
        type=_pose,
        nargs="+",
        action="extend",
        default=[],
        metavar="ROBOT:X,Y,YAW",
        help="where a recording without odometry stands (m, m, rad)",
    )
    replay.add_argument(
        "--frame",
        type=_frame,
        metavar="NAME",
        help="map that the recordings share, such as `shared` (default: each its own)",
    )
    replay.add_argument(
        "--force", action="store_true", help="also where a live robot may be listening"
    )
    for part in (serve, fiware, emulator, replay):
        part.add_argument(
            "--until-eof", action="store_true", help="end when the input closes"
        )
    add_robot_arguments(commands)
    add_experiment_arguments(commands)
    commands.add_parser("provision", help="make devices and subscriptions")
    commands.add_parser("doctor", help="try every hop once and say what is broken")
    commands.add_parser("settings", help="print docs/settings.md")
    database = commands.add_parser("db", help="the history's database")
    database.add_argument("action", choices=("upgrade",))
    return parser


def _positive(text: str) -> int:
    number = int(text)
    if not 1 <= number <= 100:
        raise argparse.ArgumentTypeError("a number from 1 to 100")
    return number


def _rate(text: str) -> float:
    rate = float(text)
    if not 1.0 <= rate <= 60.0:
        raise argparse.ArgumentTypeError("a rate from 1 to 60 (Hz)")
    return rate


def _pose(text: str) -> tuple[str, Pose2D]:
    robot_id, _, place = text.partition(":")
    try:
        x, y, yaw = (float(part) for part in place.split(","))
    except ValueError:
        x = y = yaw = math.nan
    if not all(abs(one) <= _FARTHEST_M for one in (x, y, yaw)):
        raise argparse.ArgumentTypeError("ROBOT:X,Y,YAW in m, m, rad")
    return robot_id, Pose2D(x, y, yaw)


def _frame(text: str) -> str:
    if not is_robot_id(text):
        raise argparse.ArgumentTypeError("a name of letters, digits and hyphens")
    return text


def _speed(text: str) -> float:
    factor = float(text)
    if not 0.01 <= factor <= 100.0:
        raise argparse.ArgumentTypeError("a factor from 0.01 to 100")
    return factor
