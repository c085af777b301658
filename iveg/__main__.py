"""Starts the command line: ``python -m iveg``."""

import gc
import sys

# What is imported stays: to look through it again and again would find nothing.
gc.set_threshold(100_000, 20, 50)

from iveg.cli import main  # noqa: E402 - after the line above


def run() -> None:
    """Run and leave with the command's exit code."""
    sys.exit(main(sys.argv[1:]))


if __name__ == "__main__":
    run()
