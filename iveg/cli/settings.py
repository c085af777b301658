"""``iveg settings``: prints the page of settings."""

from iveg.cli.arguments import CommandCall
from iveg.settings import describe


def run(_: CommandCall) -> int:
    """Print docs/settings.md; returns the exit code."""
    print(describe(), end="")
    return 0
