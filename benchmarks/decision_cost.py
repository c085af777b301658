"""What a decision costs, and how late feedback is.

Run ``python -m benchmarks.decision_cost``; ``--robots``, ``--seconds`` and ``--fleets``
choose what is measured.

*Cost*: notifications of Orion as they arrive in a greenhouse with people (odometry,
720-beam scans, looks of a fleet that drives), recorded once as bytes, then read and
judged one after the other on one core: bytes → codec → world → rule → feedback.

*Latency*: the same fleet at its rates on the wall clock; from the arrival of a
notification to the moment the feedback that answers it is handed to MQTT.  The knee is
the largest fleet whose P95 stays below 5 ms.
"""

import argparse
import asyncio
import itertools
import math
import random
import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import orjson

from iveg.adapters import clock
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.comfort.maps import SCAN_TICK_S, Mapper, ScanReader
from iveg.domain.feedback import Feedback
from iveg.domain.observations import Instant, Received
from iveg.domain.peer_scan import PeerScan
from iveg.domain.records import Record
from iveg.ngsi import codec
from iveg.pipeline import Choices, build
from iveg.vital.evaluate import Evaluator
from iveg.vital.ports import Ports
from iveg.vital.record import RecordSink
from tests.fakes.journal import FakeJournal
from tests.fakes.kept import FakeChoices

BEAMS = 720
ODOMETRY_HZ, SCAN_HZ, LOOK_HZ, SAFETY_HZ = 20, 10, 10, 2
TICK_S = 0.05
GOAL_MS, LATENCY_GOAL_MS = 0.3, 5.0
WALL = 1_800_000_000.0


@dataclass(frozen=True, slots=True)
class Recorded:
    """One notification: when it comes (s from the start), of what, and its bytes."""

    at: float
    kind: str
    body: bytes


class Sink:
    """Takes records and keeps none."""

    def enqueue(self, record: Record) -> None:
        """Take one."""
        self.last = record

    async def flushed(self) -> None:
        """There is nothing to keep."""


class Telling:
    """Stands where MQTT stands: writes the feedback and keeps when it left."""

    def __init__(self) -> None:
        self.left: float | None = None
        self._writer = codec.FeedbackWriter()

    def publish_feedback(self, feedback: Feedback) -> None:
        """Write one feedback."""
        self._writer.write(feedback)
        self.left = time.perf_counter()

    def publish_peer_scan(self, scan: PeerScan) -> None:
        """Write one scan for peers."""
        codec.write_peer_scan(scan)

    def taken(self) -> float | None:
        """When the newest left since the last time of asking (s)."""
        left, self.left = self.left, None
        return left

    async def stop(self, *_: object) -> None:
        """Nobody is stopped here."""

    async def release(self, *_: object) -> None:
        """Nor released."""

    async def resume(self, *_: object) -> None:
        """Nor sent on."""

    async def goal(self, *_: object) -> None:
        """Nor sent anywhere."""

    async def set_desired_state(self, *_: object) -> None:
        """Nor held."""


def assessor_of(
    robots: tuple[str, ...], fleet: Telling, sink: RecordSink | None = None
) -> Evaluator:
    """The rule with everything round it but the network and the disk."""
    numbers, start = itertools.count(), Instant(0.0, WALL)
    ports = Ports(
        fleet,
        {},
        FakeJournal(),
        sink or Sink(),
        lambda: start,
        lambda: f"{next(numbers):026d}",
        lambda: "ok",
    )
    greenhouse, choices = load_greenhouse("agroconnect"), Choices(FakeChoices().kept)
    return build(load_fleet(words=robots), greenhouse, ports, choices).evaluator


async def draw(mapper: Mapper) -> None:
    """Draw scans as iVeg does, until cancelled."""
    while True:
        mapper.tick(clock.now())
        await asyncio.sleep(SCAN_TICK_S)


def record(robots: tuple[str, ...], seconds: float) -> list[Recorded]:
    """What Orion sends while the robots drive up and down and people cross."""
    draw = random.Random(7)  # noqa: S311 - the same fleet each time
    seqs: itertools.count[int] = itertools.count(1)
    found = [
        Recorded(number / hz + draw.uniform(0, 1 / hz), kind, b"")
        for robot in range(len(robots))
        for kind, hz in (
            (f"odometry {robot}", ODOMETRY_HZ),
            (f"scan {robot}", SCAN_HZ),
            (f"look {robot}", LOOK_HZ),
            (f"safety {robot}", SAFETY_HZ),
        )
        for number in range(int(seconds * hz))
    ]
    found.sort(key=lambda one: one.at)
    return [
        Recorded(one.at, kind, _body(robots[int(robot)], int(robot), kind, one.at, seq))
        for one, seq in zip(found, seqs, strict=False)
        for kind, robot in [one.kind.split()]
    ]


def _body(robot_id: str, number: int, kind: str, at: float, seq: int) -> bytes:
    stamp = codec.format_stamp(WALL + at)
    origin = {"boot": "b", "seq": seq, "stamp": stamp}
    x, y = _place(number, at)
    if kind == "odometry":
        pose = {"x": x, "y": y, "yaw": 0.0, "angular_velocity": 0.0}
        value: dict[str, object] = {
            "base_pose_ground_truth": {**pose, "linear_velocity": 0.8, **origin}
        }
    elif kind == "scan":
        angles = np.linspace(0, 40, BEAMS) + at
        header = {"angle_min": -math.pi, "angle_increment": math.tau / BEAMS}
        reach = {"range_min": 0.1, "range_max": 12.0, "x": 0.0, "y": 0.0, "yaw": 0.0}
        value = {
            "lidar_points": np.round(4 + 3 * np.sin(angles), 3).tolist(),
            "lidar_header": {**header, **reach, **origin},
        }
    elif kind == "look":
        value = {"bounding_boxes": _boxes(x, y, at), "detection_header": origin}
    else:
        said = {"speed_factor": 1.0, "reason": "clear", "holds": [], "ch": "c"}
        value = {"safety_state": {**said, "v": 0.8, "w": 0.0, **origin}}
    entity: dict[str, object] = {"id": robot_id, "type": "Robot"}
    for name, content in value.items():
        entity[name] = {"type": "object", "value": content, "metadata": {}}
    return orjson.dumps({"subscriptionId": "s", "data": [entity]})


def _place(number: int, at: float) -> tuple[float, float]:
    """Robots go up and down lanes that are 4 m apart (m)."""
    return 4.0 + 4.0 * number, 15.0 + 10.0 * math.sin(at * 0.08 + number)


def _boxes(x: float, y: float, at: float) -> list[dict[str, object]]:
    """A person who comes and goes across the ring, and a faint one."""
    away = 2.0 + 1.9 * math.sin(2.0 * at)
    return [
        {
            "class_id": "farmer",
            "probability": sure,
            "frame_id": "map",
            "position": {
                "xmin": x - 0.25,
                "xmax": x + 0.25,
                "ymin": y + distance - 0.25,
                "ymax": y + distance + 0.25,
                "zmin": 0.0,
                "zmax": 1.8,
            },
        }
        for distance, sure in ((away, 0.94), (5.0, 0.6))
    ]


def read(body: bytes, at: Instant) -> Iterator[Received]:
    """One notification as observations."""
    _, reading = codec.read_notification(body)
    for observation in reading.observations:
        yield Received(observation, at)


def cost(robots: int, seconds: float) -> dict[str, list[float]]:
    """How long each notification took, by kind (ms of CPU), one after the other."""
    names = tuple(f"R{number}" for number in range(robots))
    evaluator = assessor_of(names, Telling())
    took: dict[str, list[float]] = {}
    ticked = 0.0
    for one in record(names, seconds):
        now = Instant(one.at, WALL + one.at)
        begin = time.thread_time()
        for received in read(one.body, now):
            evaluator.apply(received)
        evaluator.settle()
        took.setdefault(one.kind, []).append((time.thread_time() - begin) * 1e3)
        if one.at - ticked >= TICK_S:
            ticked = one.at
            begin = time.thread_time()
            evaluator.age(now)
            evaluator.tick(now)
            took.setdefault("(tick)", []).append((time.thread_time() - begin) * 1e3)
    return took


async def latency(robots: int, seconds: float) -> list[float]:
    """From a notification that changed a speed limit to the feedback of it (ms).

    On the wall clock, with the heartbeat and the costmap beside it as in iVeg.
    """
    names = tuple(f"R{number}" for number in range(robots))
    fleet = Telling()
    evaluator = assessor_of(names, fleet)
    reader = ScanReader(lambda *_: None)
    mapper = Mapper(evaluator.world, evaluator.greenhouse.bounds, reader)
    drawing = asyncio.create_task(draw(mapper))
    recorded, took = record(names, seconds), []
    start = time.perf_counter()
    ticked = float("-inf")
    for one in recorded:
        wait = start + one.at - time.perf_counter()
        await asyncio.sleep(max(0.0, wait))
        # A notification that had to wait for its turn has waited since it was due.
        now = clock.now()
        fleet.taken()
        for received in read(one.body, now):
            evaluator.apply(received)
        evaluator.settle()
        left = fleet.taken()
        if left is not None:
            took.append((left - start - one.at) * 1e3)
        if now.mono - ticked >= TICK_S:
            ticked = now.mono
            evaluator.age(now)
            evaluator.tick(now)
    drawing.cancel()
    await asyncio.gather(drawing, return_exceptions=True)
    return took


def share(values: list[float], percent: int) -> float:
    """A percentile."""
    return statistics.quantiles(values, n=100)[percent - 1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--fleets", type=int, nargs="*", default=[5, 10, 20, 40])
    asked = parser.parse_args()
    took = cost(asked.robots, asked.seconds)
    print(
        f"cost, {asked.robots} robots x {BEAMS} beams (ms of CPU): "
        "median, P95, P99, count"
    )
    every = [
        value for kind, values in took.items() if kind[0] != "(" for value in values
    ]
    for kind, values in [*sorted(took.items()), ("all notifications", every)]:
        numbers = [statistics.median(values), share(values, 95), share(values, 99)]
        told = " ".join(f"{number:8.3f}" for number in numbers)
        print(f"  {kind:18} {told} {len(values):7d}")
    print(f"  goal: median {GOAL_MS} ms, measured {statistics.median(every):.3f} ms")
    knee = 0
    if asked.fleets:
        print("latency, notification → feedback (ms): P50, P95, P99")
    for robots in asked.fleets:
        late = asyncio.run(latency(robots, asked.seconds))
        numbers = [share(late, percent) for percent in (50, 95, 99)]
        print(f"  {robots:3d} robots " + " ".join(f"{n:8.2f}" for n in numbers))
        knee = robots if numbers[1] < LATENCY_GOAL_MS else knee
    if asked.fleets:
        print(f"  goal: P95 below {LATENCY_GOAL_MS:g} ms; the knee is at {knee} robots")


if __name__ == "__main__":
    main()
