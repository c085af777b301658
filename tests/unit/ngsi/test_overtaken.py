"""What a stream is past is not read, and nobody can tell the difference."""

from dataclasses import replace

import numpy as np
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.observations import (
    DetectionFrame,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Origin,
    Overtaken,
    Received,
)
from iveg.domain.transports import FIWARE
from iveg.domain.world import World
from iveg.ngsi import codec
from tests.builders import START, detection_frame, odometry, scan

BEFORE = Origin("boot-a", 7, "2026-11-20T10:00:00.000Z", 1_795_168_800.0)


def all_past(*_: object) -> bool:
    return True


def written(observation: Odometry | LaserScan | DetectionFrame) -> tuple[str, bytes]:
    match observation:
        case Odometry():
            return "AGI_odom", codec.write_measure(observation)
        case LaserScan():
            return "AGI_lidar2D", codec.write_measure(observation)
        case DetectionFrame():
            return "AGI_yolox_bounding_boxes", codec.write_measure(observation)


@pytest.mark.parametrize(
    "sent",
    [odometry(origin=BEFORE), scan(origin=BEFORE), detection_frame(origin=BEFORE)],
)
def test_telemetry_that_is_past_is_known_by_its_identity_alone(
    sent: Odometry | LaserScan | DetectionFrame,
) -> None:
    device, payload = written(sent)
    reading = codec.read_measure(device, payload, all_past)
    assert reading.observations == (Overtaken("AGI", BEFORE, type(sent)),)


@pytest.mark.parametrize(
    ("seq", "read_as"), [(5, DetectionFrame), (6, Overtaken), (7, Overtaken)]
)
def test_a_look_is_read_even_when_it_is_late_but_its_twin_is_not(
    seq: int, read_as: type[Observation]
) -> None:
    world = World(("AGI",))
    for taken in (6, 7):
        look = detection_frame(origin=replace(BEFORE, seq=taken))
        world.apply(Received(look, START))
    device, payload = written(detection_frame(origin=replace(BEFORE, seq=seq)))
    (read,) = codec.read_measure(device, payload, world.is_past).observations
    assert type(read) is read_as


@pytest.mark.parametrize(
    "changes", [{"boot": None}, {"seq": None}, {"seq": True}, {"boot": 7}, {"seq": -1}]
)
def test_what_has_no_proper_identity_is_read_and_judged_as_ever(
    changes: dict[str, object],
) -> None:
    _, payload = written(odometry(origin=BEFORE))
    value = orjson.loads(payload)["base_pose_ground_truth"] | changes
    body = orjson.dumps({"base_pose_ground_truth": value})
    assert codec.read_measure("AGI_odom", body, all_past) == (
        codec.read_measure("AGI_odom", body)
    )


MESSAGES = st.lists(
    st.tuples(
        st.sampled_from(["odometry", "scan", "detections"]),
        st.sampled_from(["boot-a", "boot-b", "boot-c"]),
        st.integers(0, 12),
        st.booleans(),
    ),
    max_size=60,
)
"""Kind, boot, seq, and whether the queue is emptied before the next is read."""


class Listener:
    """A world behind a queue; with or without looking at what it reads."""

    def __init__(self, *, skips: bool) -> None:
        self.world = World(("AGI",))
        self._waiting: list[Received] = []
        self._is_past = self.world.is_past if skips else None
        self.skipped = 0

    def hear(self, device: str, payload: bytes, at: Instant) -> None:
        reading = codec.read_measure(device, payload, self._is_past)
        for one in reading.observations:
            self.skipped += isinstance(one, Overtaken)
            self._waiting.append(Received(one, at, FIWARE.id))

    def catch_up(self) -> None:
        for received in self._waiting:
            self.world.apply(received)
        self._waiting.clear()

    def told(self) -> tuple[object, ...]:
        robot = self.world.robots["AGI"]
        known = robot.odometry, robot.pose_at, robot.heard_at, robot.detections_at
        scan = robot.scan
        swept = isinstance(scan, LaserScan) and (scan.origin, scan.ranges.tolist())
        frame = robot.frame and robot.frame.origin
        return (*known, swept, frame, robot.clock, dict(self.world.counters))


def observed(kind: str, boot: str, seq: int) -> Odometry | LaserScan | DetectionFrame:
    named = replace(BEFORE, boot=boot, seq=seq)
    kinds: dict[str, Observation] = {
        "odometry": odometry(x=float(seq), origin=named),
        "scan": scan(ranges=[1.5 + seq, np.inf, 2.5], origin=named),
        "detections": detection_frame(origin=named),
    }
    found = kinds[kind]
    assert isinstance(found, Odometry | LaserScan | DetectionFrame)
    return found


@given(MESSAGES)
def test_the_world_is_the_same_as_if_everything_were_read(
    messages: list[tuple[str, str, int, bool]],
) -> None:
    reads_all, skips = Listener(skips=False), Listener(skips=True)
    for number, (kind, boot, seq, catches_up) in enumerate(messages):
        device, payload = written(observed(kind, boot, seq))
        for listener in (reads_all, skips):
            listener.hear(device, payload, START.later(number / 30))
            if catches_up:
                listener.catch_up()
    for listener in (reads_all, skips):
        listener.catch_up()
    assert skips.told() == reads_all.told()
    assert reads_all.skipped == 0
