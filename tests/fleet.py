"""A fleet that only talks: odometry, scans and detections of many robots, at a rate.

    python -m tests.fleet --port 1883 --robots 20 --hz 30 --scene calm

A process of its own, cheap enough to stand beside what it loads: it writes MQTT 3.1.1
at QoS 0 itself and keeps the digits of its scans ready.  Robots drive in circles, each
in a field of its own; ranges have a float32's digits, as a real driver prints them.
"""

import argparse
import math
import select
import socket
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from random import Random

import numpy as np

FIELD_M = 12.0
BEAMS = 720
PICTURES = 12
"""Different scans and looks of a robot; made once, said again and again."""
SENSORS = ("odom", "lidar2D", "yolox_bounding_boxes")


def names(count: int) -> list[str]:
    """The ids of the fleet."""
    return [f"R{number:02d}" for number in range(1, count + 1)]


@dataclass
class Robot:
    """One robot: where it drives, and what it says of it."""

    number: int
    apikey: str
    storm: bool
    beams: int
    line: socket.socket
    said: int = 0
    scans: list[str] = field(default_factory=list)
    looks: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        rnd = Random(self.number)  # noqa: S311 - repeatable on purpose
        self.id = names(self.number + 1)[-1]
        self.scans = [_scan(rnd, self.beams) for _ in range(PICTURES)]
        self.looks = [_look(rnd, storm=self.storm) for _ in range(PICTURES)]

    def say(self, sensor: str, at: float) -> None:
        """One message of one sensor."""
        moment = datetime.fromtimestamp(at, UTC)
        stamp = f"{moment:%Y-%m-%dT%H:%M:%S.%f}Z"
        origin = f'"boot":"fleet","seq":{self.said},"stamp":"{stamp}"'
        body = self._body(sensor, at, origin)
        self.said += 1
        topic = f"/{self.apikey}/{self.id}_{sensor}/attrs"
        payload = f'{{{body},"TimeInstant":"{stamp}"}}'
        self.line.sendall(_publish(topic.encode(), payload.encode()))

    def _body(self, sensor: str, at: float, origin: str) -> str:
        picture = self.said // len(SENSORS) % PICTURES
        if sensor == "odom":
            return f'"base_pose_ground_truth":{{{self._motion(at)},{origin}}}'
        if sensor == "lidar2D":
            step = 2 * math.pi / self.beams
            head = (
                f'"angle_min":{-math.pi},"angle_increment":{step},"range_min":0.1,'
                f'"range_max":10.0,"x":0,"y":0,"yaw":0,{origin}'
            )
            return f'"lidar_points":{self.scans[picture]},"lidar_header":{{{head}}}'
        look = self.looks[picture]
        return f'"bounding_boxes":{look},"detection_header":{{{origin}}}'

    def _motion(self, at: float) -> str:
        """A circle of 1 m at about half a metre a second."""
        rate = 0.4 + 0.02 * (self.number % 7)
        angle = rate * at + self.number
        x = FIELD_M * (self.number % 6 + 0.5) + math.cos(angle)
        y = FIELD_M * (self.number // 6 + 0.5) + math.sin(angle)
        yaw = math.remainder(angle + math.pi / 2, 2 * math.pi)
        return (
            f'"x":{x:.6f},"y":{y:.6f},"yaw":{yaw:.6f},'
            f'"linear_velocity":{rate:.6f},"angular_velocity":{rate:.6f}'
        )


def _scan(rnd: Random, beams: int) -> str:
    """A room with four walls, seen from its middle."""
    angles = np.linspace(-math.pi, math.pi, beams, endpoint=False)
    width, height = rnd.uniform(3.0, 5.0), rnd.uniform(3.0, 5.0)
    with np.errstate(divide="ignore"):
        walls = np.minimum(width / abs(np.cos(angles)), height / abs(np.sin(angles)))
    noise = [rnd.gauss(0.0, 0.02) for _ in range(beams)]
    ranges = (walls + noise).astype(np.float32).astype(float)
    return "[" + ",".join(f"{one:.11f}" for one in ranges) + "]"


def _look(rnd: Random, *, storm: bool) -> str:
    """Calm: a person 4 m ahead and three things; a storm: no two looks alike."""
    boxes = []
    for number in range(4):
        x, y = 4.0 + 0.5 * number, 1.2 * (number - 1)
        name, sure = ("car", "person", "dog", "cone")[number], 0.93
        if storm:
            x, y = rnd.uniform(1.5, 5.0), rnd.uniform(-1.0, 1.0)
            name, sure = rnd.choice(("person", "car", "dog")), rnd.uniform(0.4, 0.99)
        x, y = x + rnd.gauss(0.0, 0.02), y + rnd.gauss(0.0, 0.02)
        boxes.append(
            f'{{"class_id":"{name}","probability":{sure:.4f},"frame_id":"base_link",'
            f'"position":{{"xmin":{x - 0.3:.3f},"xmax":{x + 0.3:.3f},'
            f'"ymin":{y - 0.3:.3f},"ymax":{y + 0.3:.3f},"zmin":0,"zmax":1.8}}}}'
        )
    return "[" + ",".join(boxes) + "]"


# --- MQTT ---------------------------------------------------------------------------


def _dial(port: int, name: str) -> socket.socket:
    line = socket.create_connection(("127.0.0.1", port))
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    said = _text(b"MQTT") + bytes((4, 2, 0, 0)) + _text(name.encode())
    line.sendall(b"\x10" + _length(len(said)) + said)
    answer = line.recv(4)
    if answer != b"\x20\x02\x00\x00":
        raise ConnectionError(f"the broker answers {answer!r}")
    return line


def _publish(topic: bytes, payload: bytes) -> bytes:
    said = _text(topic) + payload
    return b"\x30" + _length(len(said)) + said


def _text(words: bytes) -> bytes:
    return len(words).to_bytes(2, "big") + words


def _length(rest: int) -> bytes:
    digits = bytearray()
    while True:
        rest, digit = divmod(rest, 128)
        digits.append(digit | (128 if rest else 0))
        if not rest:
            return bytes(digits)


# --- the rate -------------------------------------------------------------------------


def _turns(robots: list[Robot], hz: float) -> Iterator[tuple[float, Robot, str]]:
    """Who speaks when (s from now): each at its rate, all spread evenly, without end.

    A little is added that never repeats: messages in step with a screen's frames would
    meet all of them at the same moment.
    """
    speakers = [(robot, sensor) for sensor in SENSORS for robot in robots]
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    turn = 0
    while True:
        for place, (robot, sensor) in enumerate(speakers):
            apart = place / len(speakers) + 0.5 * (turn * golden % 1.0)
            yield (turn + apart) / hz, robot, sensor
        turn += 1


def drive(robots: list[Robot], hz: float) -> None:
    """Talk until somebody ends it."""
    start = time.monotonic() + 0.1
    for due, robot, sensor in _turns(robots, hz):
        wait = start + due - time.monotonic()
        if wait > 0:
            select.select((), (), (), wait)
        robot.say(sensor, time.time())


def main() -> None:
    """Talk as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--hz", type=float, default=30.0)
    parser.add_argument("--beams", type=int, default=BEAMS)
    parser.add_argument("--apikey", default="iveg")
    parser.add_argument("--scene", choices=("calm", "storm"), default="calm")
    asked = parser.parse_args()
    robots = [
        Robot(
            number,
            asked.apikey,
            asked.scene == "storm",
            asked.beams,
            _dial(asked.port, f"fleet-{number}"),
        )
        for number in range(asked.robots)
    ]
    try:
        drive(robots, asked.hz)
    except (BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
        sys.exit(0)


if __name__ == "__main__":
    main()
