"""Arguments of every command (docs/interfaces/cli.md)."""

import argparse
import math
from pathlib import Path
from typing import TypeAlias

from iveg import __version__
from iveg.domain.fleet import is_robot_id
from iveg.domain.geometry import Pose2D

_Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"
_FARTHEST_M = 1e6


def parser() -> argparse.ArgumentParser:
    """All commands, in the order of ``iveg --help``."""
    parser = argparse.ArgumentParser(
        prog="iveg", description="Supervise mixed robot fleets in greenhouses."
    )
    parser.add_argument("--version", action="version", version=f"iveg {__version__}")
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="log what goes well, too"
    )
    commands = parser.add_subparsers(dest="command", required=True)
    _add_demo(commands)
    _add_serve(commands)
    _add_end(commands.add_parser("fiware", help="MQTT broker, Orion and IoT Agent"))
    _add_emulator(commands)
    _add_replay(commands)
    _add_robot(commands)
    _add_experiment(commands)
    commands.add_parser("provision", help="make devices and subscriptions")
    commands.add_parser("doctor", help="try every hop once and say what is broken")
    commands.add_parser("settings", help="print docs/settings.md")
    database = commands.add_parser("db", help="the history's database")
    database.add_argument("action", choices=("upgrade",))
    return parser


def _add_demo(commands: _Commands) -> None:
    demo = commands.add_parser("demo", help="everything on one machine")
    demo.add_argument(
        "--no-emulator", action="store_true", help="no robots: for `iveg replay`"
    )
    demo.add_argument(
        "--ros2", action="store_true", help="the robots speak ROS 2, as real ones do"
    )


def _add_serve(commands: _Commands) -> None:
    serve = commands.add_parser("serve", help="the DSS and its page")
    serve.add_argument("--demo", action="store_true", help=argparse.SUPPRESS)
    _add_end(serve)


def _add_emulator(commands: _Commands) -> None:
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
    _add_network(emulator)
    _add_end(emulator)


def _add_replay(commands: _Commands) -> None:
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
    _add_end(replay)


def _add_robot(commands: _Commands) -> None:
    robot = commands.add_parser("robot", help="a ROS 2 robot joins")
    robot.add_argument("action", nargs="?", choices=("run", "check"), default="run")
    robot.add_argument("--id", required=True, metavar="ROBOT", help="as iVeg knows it")
    robot.add_argument("--config", type=Path, metavar="robot.toml")
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
    _add_end(robot)
    _add_network(robot)


def _add_network(parser: argparse.ArgumentParser) -> None:
    """Options for the ROS 2 network."""
    parser.add_argument("--ros-domain", type=int, metavar="N", help="0 to 232")
    parser.add_argument("--ros-interface", metavar="NAME", help="or its address")
    parser.add_argument(
        "--ros-peer", nargs="+", metavar="ADDRESS", help="where multicast does not pass"
    )


def _add_experiment(commands: _Commands) -> None:
    experiment = commands.add_parser("experiment", help="the paper's evaluation")
    words = experiment.add_subparsers(dest="word", required=True)
    run = words.add_parser("run", help="run it; what broke off is taken up again")
    size = run.add_mutually_exclusive_group()
    for name, told in (
        ("minimal", "one scenario, seconds: whether it works at all"),
        ("quick", "every scenario once, three minutes (the usual)"),
        ("full", "every scenario five times, over 100,000 messages"),
    ):
        size.add_argument(
            f"--{name}", dest="size", action="store_const", const=name, help=told
        )
    run.set_defaults(size="quick")
    run.add_argument(
        "--fiware",
        nargs="+",
        default=["embedded"],
        metavar="URL",
        help="a FIWARE of its own (embedded, the usual), the one that the settings "
        "name (settings), or Orion's address, the IoT Agent's and the broker's",
    )
    run.add_argument("--profile", choices=("field", "simulation"), default="field")
    run.add_argument("--seed", type=int, metavar="S")
    run.add_argument("--out", type=Path, metavar="DIR", help="where results go")
    _add_end(run)
    compare = words.add_parser("compare", help="two results beside each other")
    compare.add_argument("before", type=Path, metavar="A")
    compare.add_argument("after", type=Path, metavar="B")


def _add_end(parser: argparse.ArgumentParser) -> None:
    """For a part that its parent ends."""
    parser.add_argument(
        "--until-eof", action="store_true", help="end when the input closes"
    )


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
