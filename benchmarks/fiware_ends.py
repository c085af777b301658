"""Both ends of the FIWARE transport, each a process that does nothing but its part.

``send PORT ROBOTS SECONDS`` writes packets that were encoded before to a plain socket;
``receive`` takes the time of each notification and answers 204.  A measure carries the
moment it left as its ``seq``, so the ends need no word with each other: processes of
one machine share the monotonic clock.
"""

import asyncio
import json
import random
import re
import resource
import socket
import sys
import time
from contextlib import ExitStack
from threading import Thread

import numpy as np
import orjson
import uvloop

from benchmarks.process import pause
from iveg.lab.embedded.mqtt_broker import publish_packet

RATE_HZ = 30
TOPICS = 3
BEAMS = 720
HOST = "127.0.0.1"
_LINGER_S = 1.0
_WIDTH = 16
_BASE = 10 ** (_WIDTH - 1)
"""Keeps every moment (µs) equally wide, so that it is patched in place."""
_LEFT = re.compile(rb'"seq":(\d{16})')
_LENGTH = re.compile(rb"content-length: *(\d+)", re.IGNORECASE)
_FILTER = b"/iveg/+/attrs"
_SUBSCRIBE = (
    b"\x82" + bytes([len(_FILTER) + 5, 0, 1, 0, len(_FILTER)]) + _FILTER + b"\x00"
)


def measures(robot: str) -> list[tuple[str, bytes]]:
    """What one robot sends at one tick: topic and payload."""
    draw = random.Random(robot)  # noqa: S311 - a benchmark
    ranges = [_as_a_driver(draw.uniform(0.1, 12.0)) for _ in range(BEAMS)]
    origin: dict[str, object] = {
        "boot": "b00t",
        "seq": _BASE,
        "stamp": "2026-11-20T14:13:07.754Z",
    }
    pose: dict[str, object] = {
        "x": 1.234,
        "y": 2.345,
        "yaw": 0.123,
        "linear_velocity": 0.5,
    }
    scan: dict[str, object] = {
        "angle_min": -3.14159,
        "angle_increment": 0.00873,
        "range_max": 12.0,
    }
    place = {"xmin": 1.1, "xmax": 1.5, "ymin": 2.2, "ymax": 2.7, "zmin": 0, "zmax": 1.7}
    box = {"class_id": "farmer", "probability": 0.94, "position": place}
    told: list[tuple[str, object]] = [
        ("odom", {"base_pose_ground_truth": pose | origin}),
        ("lidar2D", {"lidar_points": ranges, "lidar_header": scan | origin}),
        (
            "yolox_bounding_boxes",
            {"bounding_boxes": [box, box], "detection_header": origin},
        ),
    ]
    return [(f"/iveg/{robot}_{kind}/attrs", orjson.dumps(what)) for kind, what in told]


def _as_a_driver(metres: float) -> float:
    """A float32 with the decimals that it has, as ``sensor_msgs/LaserScan`` is printed.

    A scan of round millimetres is the easiest there is to print; no driver sends one.
    """
    return round(float(np.float32(metres)), 11)


def _moment_us() -> int:
    return time.perf_counter_ns() // 1000


# --- the robots -------------------------------------------------------------------


def send(port: int, robots: int, seconds: float) -> None:
    """Keep the rate for a while; say how many went and how late the latest was."""
    packets = [
        [bytearray(publish_packet(*one)) for one in measures(f"R{index}")]
        for index in range(robots)
    ]
    places = [[one.index(b"%d" % _BASE) for one in each] for each in packets]
    with ExitStack() as lines:
        listener = lines.enter_context(_connected(port, "listener"))
        listener.sendall(_SUBSCRIBE)
        Thread(target=_hear, args=(listener,), daemon=True).start()
        robots_lines = [
            lines.enter_context(_connected(port, f"load{index}"))
            for index in range(robots)
        ]
        told = _drive(robots_lines, packets, places, seconds)
        # A broker may forget what a client that has left said last.
        pause(_LINGER_S)
        for line in (*robots_lines, listener):
            line.sendall(b"\xe0\x00")
    used = resource.getrusage(resource.RUSAGE_SELF)
    print(json.dumps({**told, "cpu_s": used.ru_utime + used.ru_stime}))


def _connected(port: int, name: str) -> socket.socket:
    line = socket.create_connection((HOST, port))
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    head = b"\x00\x04MQTT\x04\x02\x00\x00" + len(name).to_bytes(2, "big")
    body = head + name.encode()
    line.sendall(b"\x10" + bytes([len(body)]) + body)
    line.recv(4)
    return line


def _hear(line: socket.socket) -> None:
    """What reads MQTT directly: hears every measure and does nothing with it."""
    while line.recv(1 << 18):
        pass


def _drive(
    lines: list[socket.socket],
    packets: list[list[bytearray]],
    places: list[list[int]],
    seconds: float,
) -> dict[str, float]:
    start, count, latest = time.perf_counter(), 0, 0.0
    # Spread over the tick, as robots and their topics are.
    step = 1.0 / (RATE_HZ * len(packets) * TOPICS)
    while (due := count * step) < seconds:
        robot, topic = divmod(count % (len(packets) * TOPICS), TOPICS)
        early = start + due - time.perf_counter()
        if early > 0:
            pause(early)
        latest = max(latest, time.perf_counter() - start - due)
        packet, place = packets[robot][topic], places[robot][topic]
        packet[place : place + _WIDTH] = b"%d" % (_BASE + _moment_us())
        lines[robot].sendall(packet)
        count += 1
    spent = time.perf_counter() - start
    return {"count": count, "spent_s": spent, "latest_s": latest}


# --- the dashboard ----------------------------------------------------------------


class Receiver(asyncio.Protocol):
    """Answers notifications; a ``GET`` is answered with what was measured since."""

    ages: list[int] = []  # noqa: RUF012 - one list for all connections
    """How long each measure took (µs)."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Somebody calls."""
        self._transport: asyncio.Transport = transport  # type: ignore[assignment]
        self._held = b""

    def data_received(self, data: bytes) -> None:
        """Parts of requests; they may come several at once."""
        at = _moment_us() + _BASE
        held = self._held + data if self._held else data
        while (end := held.find(b"\r\n\r\n")) >= 0:
            length = _LENGTH.search(held, 0, end)
            whole = end + 4 + (int(length[1]) if length else 0)
            if len(held) < whole:
                break
            self._take(held, end, whole, at)
            held = held[whole:]
        self._held = held

    def _take(self, held: bytes, end: int, whole: int, at: int) -> None:
        if held.startswith(b"GET"):
            body = orjson.dumps(Receiver.ages)
            head = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body)
            self._transport.write(head + body)
            Receiver.ages = []
            return
        left = _LEFT.search(held, end, whole)
        if left is not None:
            Receiver.ages.append(at - int(left[1]))
        self._transport.write(b"HTTP/1.1 204 No Content\r\n\r\n")


async def receive() -> None:
    """Until the process is ended; prints its port."""
    loop = asyncio.get_running_loop()
    server = await loop.create_server(Receiver, HOST, 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    if sys.argv[1] == "send":
        send(int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]))
    else:
        uvloop.run(receive())
