"""Starts the command line: ``python -m iveg``."""

import sys

from iveg.cli import main


def run() -> None:
    """Run and leave with the command's exit code."""
    sys.exit(main(sys.argv[1:]))


if __name__ == "__main__":
    run()
