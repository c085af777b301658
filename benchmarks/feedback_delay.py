"""How late feedback is: ``python -m benchmarks.feedback_delay [--robots 5 20]``.

From the arrival of a picture that slows its robot to the feedback that tells the fleet
(ms), on the wall clock, with the real rule loop, its pacing, heartbeat and costmap.
Each robot sends odometry, a scan and a picture at 30 Hz.  Every two seconds it stands
in an empty place, and after 1.3 s a picture there shows somebody a metre away.

``off``: everything comes as Orion's notifications.  ``on``: everything is read from
MQTT, as often as iVeg reads there, and the notification of each picture follows.
Sockets are left out.  Goal: P95 of 5 ms with 5 robots and of 15 ms with 20.
"""

import argparse
import asyncio
import math
import random
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import orjson

from benchmarks.decision_cost import Sink, Telling
from benchmarks.process import machine, percentile, print_table
from iveg.adapters import clock
from iveg.adapters.clock import new_id
from iveg.adapters.direct import DirectReader
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.comfort.mapping import Mapper
from iveg.domain.feedback import Feedback
from iveg.domain.observations import Received
from iveg.domain.transports import DIRECT, FIWARE
from iveg.ngsi import codec, names
from iveg.pipeline import Choices, Pipeline, Ports, build
from tests.fakes.journal import FakeJournal

RATE_HZ = 30
PLACE_S, SHOWN_AFTER_S = 2.0, 1.3
TWIN_AFTER_S = 0.003
BEAMS = 720
GOALS_MS = {5: 5.0, 20: 15.0}
KINDS = "_odom", "_lidar2D", "_yolox_bounding_boxes"
Spot = tuple[str, float, float]
"""Who sees somebody, and where (m)."""


@dataclass(frozen=True, slots=True)
class Message:
    """One message: when it comes (s), its device, what it says, whom it shows first."""

    at: float
    robot_id: str
    suffix: str
    values: Mapping[str, object]
    shows: Spot | None = None

    def measure(self) -> tuple[str, bytes]:
        """As its robot publishes it."""
        topic = names.measure_topic("bench", self.robot_id + self.suffix)
        return topic, orjson.dumps(self.values)

    def notification(self) -> bytes:
        """As Orion notifies it."""
        told = {
            name: {"type": "object", "value": value, "metadata": {}}
            for name, value in self.values.items()
        }
        entity = {"id": self.robot_id, "type": "Robot", **told}
        return orjson.dumps({"subscriptionId": "s", "data": [entity]})


def story(robots: int, seconds: float) -> Iterator[Message]:
    """What comes, in order, sends spread over the period in an order of chance."""
    places = [(n, kind) for n in range(robots) for kind in KINDS]
    random.Random(5).shuffle(places)  # noqa: S311 - the same each time
    last: dict[int, float] = {}
    for turn in range(round(seconds * RATE_HZ)):
        for place, (number, suffix) in enumerate(places):
            at = (turn + place / len(places)) / RATE_HZ
            yield _said(number, suffix, turn, at, last)


def _said(
    number: int, suffix: str, turn: int, at: float, last: dict[int, float]
) -> Message:
    robot_id = f"R{number:02d}"
    stamp = codec.format_stamp(time.time() + at)
    origin = {"boot": "b", "seq": turn, "stamp": stamp}
    # Robots change their places in turns, so that news are spread over the time.
    epoch, here_s = divmod(at + number * PLACE_S * 0.38, PLACE_S)
    x, y = 15.0 * epoch, 15.0 * number
    if suffix == "_odom":
        pose = {"x": x, "y": y, "yaw": 0.0, "linear_velocity": 0.5}
        whole = pose | {"angular_velocity": 0.0} | origin
        return Message(at, robot_id, suffix, {names.ODOMETRY: whole})
    if suffix == "_lidar2D":
        header = {"angle_min": -math.pi, "angle_increment": math.tau / BEAMS}
        reach = {"range_min": 0.1, "range_max": 12.0, "x": 0.0, "y": 0.0, "yaw": 0.0}
        ranges = (4.0 + np.sin(np.linspace(0, 40, BEAMS) + at)).round(11).tolist()
        scan = {names.LIDAR: ranges, names.LIDAR_HEADER: header | reach | origin}
        return Message(at, robot_id, suffix, scan)
    shown = here_s >= SHOWN_AFTER_S
    is_first = shown and last.get(number) != epoch
    if is_first:
        last[number] = epoch
    boxes = [_box("crate", x + 3.0, y + each) for each in range(3)]
    boxes += [_box("person", x + 1.0, y)] * shown
    picture = {names.BOXES: boxes, names.BOXES_HEADER: origin}
    spot = (robot_id, x + 1.0, y) if is_first else None
    return Message(at, robot_id, suffix, picture, spot)


def _box(word: str, x: float, y: float) -> dict[str, object]:
    sides = {"xmin": x - 0.25, "xmax": x + 0.25, "ymin": y - 0.25, "ymax": y + 0.25}
    position = sides | {"zmin": 0.0, "zmax": 1.8}
    found = {"class_id": word, "probability": 0.94, "frame_id": "map"}
    return found | {"position": position}


class Listening(Telling):
    """Keeps when feedback first told of each spot (s)."""

    def __init__(self) -> None:
        super().__init__()
        self.told: dict[Spot, float] = {}

    def publish_feedback(self, feedback: Feedback) -> None:
        """Write one feedback, and look whom it tells of."""
        super().publish_feedback(feedback)
        for alert in feedback.alerts:
            if alert.position is not None:
                x, y, _ = alert.position
                spot = alert.observer or "", round(x, 3), round(y, 3)
                self.told.setdefault(spot, time.perf_counter())


async def delays(robots: int, seconds: float, *, direct: bool) -> list[float]:
    """Of each picture that showed somebody new (ms)."""
    told = list(story(robots, seconds))
    heard, fleet = Listening(), load_fleet(words=[f"R{n:02d}" for n in range(robots)])
    greenhouse = load_greenhouse("none")
    ports = Ports(
        heard,
        {DIRECT: heard, FIWARE: heard},
        FakeJournal(),
        Sink(),
        clock.now,
        new_id,
    )
    parts = build(fleet, greenhouse, ports, Choices())
    mapper = Mapper(parts.world, greenhouse.bounds)
    living = [
        asyncio.create_task(parts.loop.run()),
        asyncio.create_task(mapper.run(clock.now)),
    ]
    came = await (_directly if direct else _through_orion)(parts, told)
    await asyncio.sleep(1.0)
    for one in living:
        one.cancel()
    await asyncio.gather(*living, return_exceptions=True)
    told_at = (heard.told.get(spot, math.inf) - at for spot, at in came.items())
    return sorted(1e3 * late for late in told_at)


async def _through_orion(parts: Pipeline, told: list[Message]) -> dict[Spot, float]:
    """Play the story; returns when each spot's picture came (s)."""
    came: dict[Spot, float] = {}
    bodies = [one.notification() for one in told]
    start = time.perf_counter() + 0.1
    for one, body in zip(told, bodies, strict=True):
        await _until(start + one.at)
        if one.shows is not None:
            came[one.shows] = start + one.at
        _notify(parts, body)
    return came


def _notify(parts: Pipeline, body: bytes) -> None:
    _, reading = codec.read_notification(body, parts.ingest.is_past)
    for observation in reading.observations:
        parts.ingest.enqueue(Received(observation, clock.now(), FIWARE.id))


async def _directly(parts: Pipeline, told: list[Message]) -> dict[Spot, float]:
    """The same, by both ways."""
    robots = list(parts.world.robots)
    reader = DirectReader(
        "bench",
        robots,
        clock.now,
        parts.ingest,
    )
    came: dict[Spot, float] = {}
    measures = [one.measure() for one in told]
    twins = [one.notification() if one.suffix == KINDS[2] else b"" for one in told]
    loop, start = asyncio.get_running_loop(), time.perf_counter() + 0.1
    for one, measure, twin in zip(told, measures, twins, strict=True):
        await _until(start + one.at)
        if one.shows is not None:
            came[one.shows] = start + one.at
        reader.read(*measure)
        if twin:
            after = start + one.at + TWIN_AFTER_S - time.perf_counter()
            loop.call_later(max(0.0, after), _notify, parts, twin)
    return came


async def _until(moment: float) -> None:
    wait = moment - time.perf_counter()
    if wait > 0.0:
        await asyncio.sleep(wait)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, nargs="+", default=[5, 20])
    parser.add_argument("--seconds", type=float, default=20.0)
    asked, _ = parser.parse_known_args()
    rows = []
    for robots in asked.robots:
        for direct in (False, True):
            late = asyncio.run(delays(robots, asked.seconds, direct=direct))
            shares = (f"{percentile(late, share):.1f}" for share in (0.5, 0.95, 0.99))
            goal = f"{GOALS_MS[robots]:g}" if robots in GOALS_MS else "-"
            way = "on" if direct else "off"
            rows.append([str(robots), way, *shares, goal, str(len(late))])
    head = ("robots", "direct", "P50 ms", "P95 ms", "P99 ms", "goal", "pictures")
    print_table(f"Picture → feedback ({machine()})", head, rows)


if __name__ == "__main__":
    main()
