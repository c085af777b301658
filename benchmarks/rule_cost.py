"""Cost of the rule: ``python -m benchmarks.rule_cost [--robots 5 10 20]``.

CPU seconds per 1,000 messages of the rule loop alone, everything read already: each
robot sends odometry, a scan and four boxes at 30 Hz, feedback is written as for MQTT.
``calm``: one person before each robot.  ``storm``: no two pictures alike.  Messages are
taken one by one, as on an idle machine, and eight at a time, as when it is busy.  The
laser tracks of a robot take scans beside it.

``decisions`` is a digest of all feedback and of all rows of the history: two trees that
decide alike, to the last digit, have the same.
"""

import argparse
import hashlib
import itertools
import math
import random
import time
from collections.abc import Iterator

import numpy as np

from benchmarks.process import print_table
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.feedback import Feedback
from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Origin,
    Received,
)
from iveg.domain.peer_scan import PeerScan
from iveg.domain.records import Record
from iveg.domain.transports import FIWARE
from iveg.ngsi import codec
from iveg.pipeline import Choices, Pipeline
from iveg.vital.evaluate import Evaluator
from iveg.vital.ports import Ports
from tests.fakes.journal import FakeJournal
from tests.fakes.kept import FakeChoices

RATE_HZ = 30
TICK_S = 0.05
WALL = 1_800_000_000.0
SECONDS = 8.0
_BEAMS = np.linspace(-math.pi, math.pi, 720)
SCAN = np.minimum(1.0 / np.maximum(np.abs(np.sin(_BEAMS)), 0.01), 30.0).astype("f4")
"""An aisle two metres wide: most of what a laser sees is near."""


def story(
    robots: tuple[str, ...], *, storm: bool, seconds: float = SECONDS
) -> Iterator[Received]:
    """Messages in order of arrival: robots two lanes apart, spread over the period."""
    draw = random.Random(3)  # noqa: S311 - the same each time
    for tick in range(round(seconds * RATE_HZ)):
        for place in range(3 * len(robots)):
            at = (tick + place / 3 / len(robots)) / RATE_HZ
            number, kind = divmod(place, 3)
            origin = Origin("b", tick, "2026-11-20T14:13:07.754Z", WALL + at)
            told = _told(robots[number], number, kind, origin, at, draw, storm)
            yield Received(told, Instant(at, WALL + at), FIWARE.id)


def _told(
    robot_id: str,
    number: int,
    kind: int,
    origin: Origin,
    at: float,
    draw: random.Random,
    storm: bool,
) -> Observation:
    x, y = 6.0 * (number % 5), 12.0 * (number // 5) + 4.0 * math.sin(at * 0.2 + number)
    if kind == 0:
        return Odometry(robot_id, origin, Pose2D(x, y, 1.57), Twist2D(0.5, 0.0))
    if kind == 1:
        return LaserScan(
            robot_id, origin, -3.14, 0.0087, 0.1, 30.0, Pose2D(0.0, 0.0, 0.0), SCAN
        )
    spots = [(x, y + 4.0, "person")] + [(x + k, y + 3.0, "crate") for k in (1, 2, 3)]
    if storm:
        spots = [
            (x + draw.uniform(-5, 5), y + draw.uniform(1, 6), "person")
            for _ in range(4)
        ]
    found = tuple(
        Detection(word, 0.94, Box3D(a, a + 0.5, b, b + 0.5, 0.0, 1.7), "map")
        for a, b, word in spots
    )
    return DetectionFrame(robot_id, origin, found)


class Kept:
    """Stands where MQTT and the history stand, and keeps all that is decided."""

    def __init__(self) -> None:
        self.all: list[Feedback | Record] = []

    def publish_feedback(self, feedback: Feedback) -> None:
        """Write one feedback, and keep it."""
        codec.write_feedback(feedback)
        self.all.append(feedback)

    def publish_peer_scan(self, scan: PeerScan) -> None:
        """Write one scan for peers."""
        codec.write_peer_scan(scan)

    def enqueue(self, record: Record) -> None:
        """Keep one row."""
        self.all.append(record)

    async def flushed(self) -> None:
        """Return; nothing is stored here."""

    async def ignore(self, *_: object) -> None:
        """Ignore; no robot takes orders here."""

    set_desired_state = ignore

    @property
    def digest(self) -> str:
        """Digest of everything, in its order."""
        whole = hashlib.sha256()
        for decided in self.all:
            whole.update(repr(decided).encode())
        return whole.hexdigest()[:8]


def evaluator_of(robots: tuple[str, ...], kept: Kept) -> Evaluator:
    """The rule with everything round it but the network and the disk."""
    numbers, start = itertools.count(), Instant(0.0, WALL)
    ports = Ports(
        kept,
        {},
        FakeJournal(),
        kept,
        lambda: start,
        lambda: f"{next(numbers):026d}",
        lambda: "ok",
    )
    choices = Choices(FakeChoices().kept, "bench")
    fleet = load_fleet(words=robots)
    return Pipeline(fleet, load_greenhouse("agroconnect"), ports, choices).evaluator


def cost(
    count: int, batch: int, *, storm: bool, seconds: float = SECONDS
) -> tuple[float, str]:
    """CPU seconds per 1,000 messages, and the digest of what was decided."""
    robots = tuple(f"R{number:02d}" for number in range(count))
    kept = Kept()
    evaluator = evaluator_of(robots, kept)
    everything = list(story(robots, storm=storm, seconds=seconds))
    ticked = 0.0
    began = time.process_time()
    for start in range(0, len(everything), batch):
        part = everything[start : start + batch]
        now = part[-1].at
        for received in part:
            evaluator.apply(received)
        evaluator.settle()
        if now.mono - ticked >= TICK_S:
            ticked = now.mono
            evaluator.age(now)
            evaluator.tick(now)
    took_s = time.process_time() - began
    return took_s / len(everything) * 1000, kept.digest


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, nargs="+", default=[5, 10, 20])
    parser.add_argument("--seconds", type=float, default=SECONDS)
    asked = parser.parse_args()
    rows = []
    for count in asked.robots:
        for storm in (False, True):
            found = [
                cost(count, batch, storm=storm, seconds=asked.seconds)
                for batch in (1, 8)
            ]
            costs = [f"{took:.3f}" for took, _ in found]
            digests = " ".join(digest for _, digest in found)
            scene = "storm" if storm else "calm"
            rows.append([str(count), scene, *costs, digests])
    head = ("robots", "scene", "one by one", "eight at a time", "decisions")
    print_table("Rule loop, CPU seconds per 1,000 messages", head, rows)


if __name__ == "__main__":
    main()
