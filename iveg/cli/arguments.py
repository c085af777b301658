"""Arguments of ``iveg robot`` and ``iveg experiment``, and options for ROS 2."""

import argparse
from pathlib import Path


def add_robot_arguments(
    commands: "argparse._SubParsersAction[argparse.ArgumentParser]",
) -> None:
    """Arguments of ``iveg robot``."""
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
    robot.add_argument(
        "--until-eof", action="store_true", help="end when the input closes"
    )
    add_network_arguments(robot)


def add_network_arguments(parser: argparse.ArgumentParser) -> None:
    """Options for the ROS 2 network."""
    parser.add_argument("--ros-domain", type=int, metavar="N", help="0 to 232")
    parser.add_argument("--ros-interface", metavar="NAME", help="or its address")
    parser.add_argument(
        "--ros-peer", nargs="+", metavar="ADDRESS", help="where multicast does not pass"
    )


def add_experiment_arguments(
    commands: "argparse._SubParsersAction[argparse.ArgumentParser]",
) -> None:
    """``iveg experiment run`` and ``compare``."""
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
    run.add_argument(
        "--until-eof", action="store_true", help="end when the input closes"
    )
    compare = words.add_parser("compare", help="two results beside each other")
    compare.add_argument("before", type=Path, metavar="A")
    compare.add_argument("after", type=Path, metavar="B")
