"""Cost of recording: CPU of the server, age of what its pages are sent, and room.

    python -m benchmarks.recording_cost --robots 10 --seconds 20 --rounds 3

A real server with a reader of its page, and a fleet that talks at 30 Hz in a storm: no
two looks are alike.  The disk needs 21 GB free.  With and without recordings in turns;
an age is that of a robot's odometry when the frame with it came to the reader.
"""

import argparse
import asyncio
import itertools
import tempfile
import time
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from datetime import datetime
from pathlib import Path
from statistics import median

import orjson
from websockets.asyncio.client import ClientConnection

from benchmarks.glass import (
    WARM_UP_S,
    Place,
    iveg_side,
    spent,
    talking_fleet,
    words_of,
)
from benchmarks.process import machine, percentile, print_table
from benchmarks.readers import Reader, look

HZ = 30.0
HEAD = ("recordings", "P95 ms", "server", "MB/robot-h")


@dataclass(frozen=True, slots=True)
class Run:
    """One turn; CPU as a share of one core.

    Attributes:
        p95_ms: Age of odometry in the reader.
        robot_hour_mb: Of recordings, for one robot and hour.
    """

    p95_ms: float
    server: float
    robot_hour_mb: float


def measure(robots: int, seconds: float, scene: str, recordings: str) -> Run:
    """One turn with ``recordings`` on or off."""
    with (
        tempfile.TemporaryDirectory() as name,
        iveg_side(Path(name), robots, recordings=recordings) as place,
        talking_fleet(place, robots, scene, HZ),
    ):
        folder = Path(name) / "recordings"
        return asyncio.run(_look(place, robots, seconds, folder))


class Aging(Reader):
    """Notes how old each odometry is when it comes."""

    def __init__(self, line: ClientConnection) -> None:
        super().__init__(line)
        self.ages_s: list[float] = []

    def take(self, message: str | bytes) -> None:
        """One frame of telemetry."""
        super().take(message)
        if isinstance(message, bytes):
            now, ends = time.time(), 4 + int.from_bytes(message[:4], "little")
            for move in orjson.loads(message[4:ends])["moves"]:
                stamp = datetime.fromisoformat(move[-1])
                self.ages_s.append(now - stamp.timestamp())


async def _look(place: Place, robots: int, seconds: float, folder: Path) -> Run:
    pages: list[Aging] = []

    def page_on(line: ClientConnection) -> Aging:
        pages.append(Aging(line))
        return pages[-1]

    looking = asyncio.create_task(look(place.link, page_on))
    await asyncio.sleep(WARM_UP_S)
    (page,) = pages
    (server,) = (one for one in place.servers if "serve" in words_of(one))
    before = spent([server]), _size(folder)
    page.ages_s.clear()
    await asyncio.sleep(seconds)
    ages = sorted(page.ages_s)
    after = spent([server]), _size(folder)
    looking.cancel()
    await asyncio.gather(looking, return_exceptions=True)
    cpu_s, size = (now - then for now, then in zip(after, before, strict=True))
    hours = robots * seconds / 3600.0
    p95_ms = 1000.0 * percentile(ages, 0.95)
    return Run(p95_ms, cpu_s / seconds, size / hours / 1e6)


def _size(folder: Path) -> int:
    return sum(one.stat().st_size for one in folder.rglob("*.mcap*"))


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--scenes", default="calm,storm")
    asked = parser.parse_args()
    for scene in asked.scenes.split(","):
        runs: dict[str, list[Run]] = {"off": [], "on": []}
        for _, side in itertools.product(range(asked.rounds), runs):
            run = measure(asked.robots, asked.seconds, scene, side)
            runs[side].append(run)
        off, on = (_median(told) for told in runs.values())
        ratios = [b / a if a else 0.0 for a, b in zip(off, on, strict=True)]
        table = {"off": off, "on": on, "ratio": ratios}
        cells = [
            [side, *(f"{one:.2f}" for one in told)] for side, told in table.items()
        ]
        print_table(f"{scene}, {asked.robots} robots; {machine()}", HEAD, cells)


def _median(runs: Sequence[Run]) -> list[float]:
    return [median(values) for values in zip(*map(astuple, runs), strict=True)]


if __name__ == "__main__":
    main()
