"""What is typed after ``iveg robot``, and where ROS 2 is, for all that speak it."""

import argparse
from pathlib import Path


def add_robot_words(
    commands: "argparse._SubParsersAction[argparse.ArgumentParser]",
) -> None:
    """The words of ``iveg robot``."""
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
    add_network_words(robot)


def add_network_words(parser: argparse.ArgumentParser) -> None:
    """Where ROS 2 is."""
    parser.add_argument("--ros-domain", type=int, metavar="N", help="0 to 232")
    parser.add_argument("--ros-interface", metavar="NAME", help="or its address")
    parser.add_argument(
        "--ros-peer", nargs="+", metavar="ADDRESS", help="where multicast does not pass"
    )
