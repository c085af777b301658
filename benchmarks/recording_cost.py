"""CPU that recording costs, and the room that it takes.

    python -m benchmarks.recording_cost --robots 10 --seconds 20

Each robot sends odometry, 720 ranges and four boxes at 30 Hz, and each pose comes a
second time in a notification.  The loop's share and the thread's are told apart, as
shares of one core.
"""

import argparse
import asyncio
import tempfile
import time
from pathlib import Path

import numpy as np

from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.recorder import WRITE_S, InputRecorder
from iveg.domain.observations import Instant, Received
from iveg.domain.recordings import RecordingLimits
from iveg.domain.transports import DIRECT
from iveg.ngsi import codec
from tests.builders import (
    detection,
    detection_frame,
    notification,
    odometry,
    origin,
    pose_value,
    scan,
)

HZ = 30


class Load:
    """Messages of robots as they come in one display frame."""

    def __init__(self, robots: int) -> None:
        self._robots = [f"R{n:02d}" for n in range(1, robots + 1)]
        self._noise = np.random.default_rng(7)

    def frame(self, recorder: InputRecorder, seq: int, at: Instant) -> float:
        """Hand over one message of each kind and robot; the loop's CPU (s)."""
        spent = 0.0
        for robot_id in self._robots:
            who = origin(seq)
            x, y = self._noise.normal(5.0, 2.0, 2).tolist()
            ranges = self._noise.uniform(0.5, 20.0, 720)
            seen = [detection(x=x + n, y=y, probability=0.9) for n in range(4)]
            observed = (
                odometry(robot_id, x, y, origin=who),
                scan(robot_id, ranges, origin=who),
                detection_frame(robot_id, *seen, origin=who),
            )
            payloads = (
                codec.write_odometry(observed[0]),
                codec.write_scan(observed[1]),
                codec.write_detections(observed[2]),
            )
            body = notification({"base_pose_ground_truth": pose_value(x, y, seq=seq)})
            began = time.thread_time()
            for one, payload in zip(observed, payloads, strict=True):
                topic = f"/iveg/{robot_id}_{type(one).__name__}/attrs"
                recorder.measure(topic, payload, at, one is observed[1])
                recorder.observed(Received(one, at, DIRECT.id))
            recorder.notification(body, at, None)
            spent += time.thread_time() - began
        return spent


async def measure(robots: int, seconds: int, folder: Path) -> None:
    """Print the shares, and bytes of a robot in an hour."""
    began = Instant(time.monotonic(), time.time())
    now = [began]
    recorder = InputRecorder(
        RecordingDirectory(folder), RecordingLimits(), lambda: now[0]
    )
    load, loop_s, thread_s = Load(robots), 0.0, 0.0
    batch = round(HZ * WRITE_S)
    for first in range(0, HZ * seconds, batch):
        for seq in range(first, first + batch):
            now[0] = began.later(seq / HZ)
            loop_s += load.frame(recorder, seq, now[0])
        process, own = time.process_time(), time.thread_time()
        await recorder.write()
        thread_s += time.process_time() - process - (time.thread_time() - own)
    await recorder.close()
    size = sum(one.size for one in RecordingDirectory(folder).files())
    print(
        f"{robots} robots: loop {100 * loop_s / seconds:.2f} % of a core, "
        f"thread {100 * thread_s / seconds:.2f} %, "
        f"{size / robots / seconds * 3600 / 1e6:.0f} MB a robot and hour"
    )


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--seconds", type=int, default=20)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        asyncio.run(measure(asked.robots, asked.seconds, Path(folder)))


if __name__ == "__main__":
    main()
