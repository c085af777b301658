"""Starts the command line: ``python -m iveg``."""

import gc
import sys

# Imported objects live for ever: collecting among them often would free nothing.
gc.set_threshold(100_000, 20, 50)

from iveg.cli import main  # noqa: E402 - after the line above


def run() -> None:
    """Run a command, and exit with its code."""
    sys.exit(main(sys.argv[1:]))


if __name__ == "__main__":
    run()
