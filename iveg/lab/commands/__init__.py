"""Commands of the laboratory (docs/interfaces/cli.md); each is imported when it runs.

FIWARE and robots start without the libraries of page and history.
"""

import argparse
from pathlib import Path

from iveg.cli.arguments import CommandWord, add_end, add_network


def _add_demo(demo: argparse.ArgumentParser) -> None:
    demo.add_argument(
        "--no-emulator", action="store_true", help="no robots: for `iveg replay`"
    )
    demo.add_argument(
        "--ros2", action="store_true", help="the robots speak ROS 2, as real ones do"
    )


def _add_emulator(emulator: argparse.ArgumentParser) -> None:
    emulator.add_argument("--scenario", default="demo", metavar="NAME")
    emulator.add_argument(
        "--robots", type=_positive, metavar="N", help="how many (default: the fleet)"
    )
    emulator.add_argument("--seed", type=int, default=1, metavar="S")
    emulator.add_argument(
        "--profile",
        default="simulation",
        choices=("simulation", "field", "noisy", "perfect"),
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
        "--dds", action="store_true", help="they speak ROS 2, for `iveg robot`"
    )
    add_network(emulator)
    add_end(emulator)


def _add_experiment(experiment: argparse.ArgumentParser) -> None:
    words = experiment.add_subparsers(dest="word", required=True)
    run = words.add_parser("run", help="run it and write a report")
    size = run.add_mutually_exclusive_group()
    for name, extent in (
        ("minimal", "one scenario, seconds: whether it works at all"),
        ("quick", "every scenario once, three minutes (the usual)"),
        ("full", "every scenario five times, over 100,000 messages"),
    ):
        size.add_argument(
            f"--{name}", dest="size", action="store_const", const=name, help=extent
        )
    run.set_defaults(size="quick")
    run.add_argument("--profile", choices=("field", "simulation"), default="field")
    run.add_argument("--seed", type=int, metavar="S")
    run.add_argument("--out", type=Path, metavar="DIR", help="where results go")
    run.add_argument(
        "--keep-raw",
        action="store_true",
        help="keep truth, frames and times of every message (always with --full)",
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


COMMANDS = (
    CommandWord(
        "demo", "everything on one machine", "iveg.lab.commands.demo", _add_demo
    ),
    CommandWord(
        "fiware",
        "MQTT broker, Orion and IoT Agent",
        "iveg.lab.commands.fiware",
        add_end,
    ),
    CommandWord(
        "emulator", "simulated robots", "iveg.lab.commands.emulator", _add_emulator
    ),
    CommandWord(
        "experiment",
        "the paper's evaluation",
        "iveg.lab.commands.experiment",
        _add_experiment,
    ),
)
