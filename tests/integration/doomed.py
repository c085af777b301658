"""``iveg serve`` whose costmap fails at first, and a vital part when a file appears."""

import asyncio
import os
import sys
from pathlib import Path

from iveg.app import App
from iveg.cli.running import run_until_stopped
from iveg.cli.serve import serve
from iveg.domain.errors import IvegError
from iveg.settings import Settings
from iveg.vital.supervision import Work

DOOM = "doom"
"""The file, in the directory of the program."""


class Doomed(App):
    """An iVeg with two faults."""

    _drawn = False

    def vital(self) -> dict[str, Work]:
        return {**super().vital(), "doomed": self._wait}

    def comfort(self) -> dict[str, Work]:
        parts = super().comfort()
        mapper = parts["costmap"]

        async def draw() -> None:
            if not self._drawn:
                self._drawn = True
                raise ZeroDivisionError
            await mapper()

        return {**parts, "costmap": draw}

    async def _wait(self) -> None:
        while not Path(DOOM).exists():  # noqa: ASYNC110, ASYNC240 - a file tells nobody
            await asyncio.sleep(0.05)
        raise ZeroDivisionError


def main() -> int:
    settings, data = Settings.from_environment(os.environ), Path.cwd()
    try:
        return run_until_stopped(serve(settings, data, demo=True, make=Doomed))
    except IvegError:
        return 1


if __name__ == "__main__":
    sys.exit(main())
