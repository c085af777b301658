"""How fast the embedded FIWARE carries measures: MQTT publish → notification received.

The embedded process runs on its own, as ``iveg fiware`` does; robots and receiver share
this one.  Run ``python -m benchmarks.fiware_road``; ``--robots 2 20`` chooses fleets,
each robot sending odometry, a 720-beam scan and two boxes at 30 Hz.
"""

import argparse
import asyncio
import os
import random
import re
import socket
import statistics
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

import orjson
import uvloop

from iveg.adapters.iot_agent import IotAgentClient, provision
from iveg.adapters.orion import OrionClient
from iveg.adapters.subscriptions import ensure_subscriptions
from iveg.domain.errors import HopError
from iveg.embedded.http_server import Request, Response, http_server
from iveg.embedded.server import serve_fiware

HOST = "127.0.0.1"
RATE_HZ = 30
BEAMS = 720
TENANT = ("agroconnect", "/greenhouse")
# The receiver shares this process with the robots, so it looks and does not parse.
ENTITY = re.compile(rb'"id":"(\w+)"')
SEQ = re.compile(rb'"seq":(\d+)')
WATCHED = (b"base_pose_ground_truth", b"lidar_header", b"detection_header")


@dataclass(slots=True)
class Tally:
    """When each measure left and how long it took."""

    sent: dict[tuple[bytes, bytes, int], float] = field(default_factory=dict)
    took: list[float] = field(default_factory=list)

    async def take(self, request: Request) -> Response:
        """Take one notification and look how old its measure is."""
        at = time.perf_counter()
        robot, seq = ENTITY.search(request.body), SEQ.search(request.body)
        if robot is not None and seq is not None:
            for name in WATCHED:
                if name in request.body:
                    left = self.sent.pop((robot[1], name, int(seq[1])), None)
                    if left is not None:
                        self.took.append(at - left)
        return Response(204)


def mqtt_publish(topic: str, payload: bytes) -> bytes:
    """One QoS 0 PUBLISH packet of MQTT 3.1.1."""
    name = topic.encode()
    body = len(name).to_bytes(2, "big") + name + payload
    size, length = len(body), bytearray()
    while True:
        size, low = divmod(size, 128)
        length.append(low | (128 if size else 0))
        if not size:
            return b"\x30" + bytes(length) + body


def measures(robot: str, seq: int) -> list[tuple[bytes, str, bytes]]:
    """What one robot sends at one tick: attribute to watch, topic, payload."""
    ranges = [round(random.uniform(0.1, 12.0), 3) for _ in range(BEAMS)]  # noqa: S311
    origin = {"boot": "b00t", "seq": seq, "stamp": "2026-11-20T14:13:07.754Z"}
    pose = {"x": 1.234, "y": 2.345, "yaw": 0.123, "linear_velocity": 0.5}
    scan = {"angle_min": -3.14159, "angle_increment": 0.00873, "range_max": 12.0}
    place = {"xmin": 1.1, "xmax": 1.5, "ymin": 2.2, "ymax": 2.7, "zmin": 0, "zmax": 1.7}
    box = {"class_id": "farmer", "probability": 0.94, "position": place}
    return [
        (
            WATCHED[0],
            f"/iveg/{robot}_odom/attrs",
            orjson.dumps({"base_pose_ground_truth": {**pose, **origin}}),
        ),
        (
            WATCHED[1],
            f"/iveg/{robot}_lidar2D/attrs",
            orjson.dumps({"lidar_points": ranges, "lidar_header": {**scan, **origin}}),
        ),
        (
            WATCHED[2],
            f"/iveg/{robot}_yolox_bounding_boxes/attrs",
            orjson.dumps({"bounding_boxes": [box, box], "detection_header": origin}),
        ),
    ]


def cpu_s(pid: int) -> float:
    """CPU time of a process so far (s), from ``/proc``."""
    with open(f"/proc/{pid}/stat") as file:  # noqa: PTH123
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def free_ports(count: int) -> list[int]:
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind((HOST, 0))
    ports = [int(one.getsockname()[1]) for one in sockets]
    for one in sockets:
        one.close()
    return ports


@asynccontextmanager
async def embedded_process() -> AsyncIterator[tuple[int, list[int]]]:
    """``serve_fiware`` in a process of its own; its pid and ports."""
    ports = free_ports(3)
    command = ("-m", "benchmarks.fiware_road", "--serve", *map(str, ports))
    process = await asyncio.create_subprocess_exec(sys.executable, *command)
    try:
        async with OrionClient(f"http://{HOST}:{ports[1]}", *TENANT) as orion:
            for _ in range(200):
                try:
                    await orion.version()
                    break
                except HopError:
                    await asyncio.sleep(0.05)
        async with IotAgentClient(f"http://{HOST}:{ports[2]}", *TENANT) as agent:
            await agent.version()
        yield process.pid, ports
    finally:
        process.terminate()
        await asyncio.wait_for(process.wait(), timeout=10)


async def run_fleet(
    robots: int, seconds: float, pid: int, port: int, tally: Tally
) -> None:
    """Send for a while and print one row."""
    names = [f"R{index}" for index in range(robots)]
    _, writer = await asyncio.open_connection(HOST, port)
    writer.write(b"\x10\x10\x00\x04MQTT\x04\x02\x00\x00\x00\x04load")
    ready = [[measures(name, 0) for name in names] for _ in range(8)]
    tally.sent.clear()
    tally.took.clear()
    before, start, seq = cpu_s(pid), time.perf_counter(), 0
    while time.perf_counter() - start < seconds:
        for index, name in enumerate(names):
            # Spread over the tick, as robots are.
            due = start + (seq + index / robots) / RATE_HZ
            pause = due - time.perf_counter()
            if pause > 0.0005:
                await asyncio.sleep(pause)
            for watch, topic, payload in ready[seq % 8][index]:
                stamped = payload.replace(b'"seq":0,', b'"seq":%d,' % (seq + 1))
                tally.sent[name.encode(), watch, seq + 1] = time.perf_counter()
                writer.write(mqtt_publish(topic, stamped))
        seq += 1
    spent = time.perf_counter() - start
    used = cpu_s(pid) - before
    for _ in range(40):
        if not tally.sent:
            break
        await asyncio.sleep(0.1)
    writer.close()
    report(robots, seq * robots * 3, spent, used, tally)


def report(robots: int, count: int, spent: float, used: float, tally: Tally) -> None:
    took = sorted(tally.took) or [float("nan")]
    p50 = statistics.median(took) * 1e3
    p95 = took[int(len(took) * 0.95)] * 1e3
    p99 = took[int(len(took) * 0.99)] * 1e3
    print(
        f"{robots:>3} robots {count / spent:7.0f} /s   P50 {p50:7.2f} ms   "
        f"P95 {p95:7.2f} ms   P99 {p99:7.2f} ms   lost {len(tally.sent):>4}   "
        f"CPU {100 * used / spent:5.1f} %   {1e3 * used / count:5.2f} ms a measure",
        flush=True,
    )


async def run(fleets: list[int], seconds: float) -> None:
    tally = Tally()
    async with (
        embedded_process() as (pid, ports),
        http_server(tally.take, HOST, 0) as notify_port,
        OrionClient(f"http://{HOST}:{ports[1]}", *TENANT) as orion,
        IotAgentClient(f"http://{HOST}:{ports[2]}", *TENANT) as agent,
    ):
        names = [f"R{index}" for index in range(max(fleets))]
        await provision(agent, orion, names, "iveg", f"http://{HOST}:{ports[1]}")
        url = f"http://{HOST}:{notify_port}/ngsi/notifications"
        await ensure_subscriptions(orion, url, "ab" * 16)
        for robots in fleets:
            await run_fleet(robots, seconds, pid, ports[0], tally)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, nargs="+", default=[2, 5, 10, 20])
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--serve", type=int, nargs=3, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.serve:
        mqtt, orion, iota = ((HOST, port) for port in chosen.serve)
        uvloop.run(serve_fiware(mqtt, orion, iota))
    else:
        uvloop.run(run(chosen.robots, chosen.seconds))


if __name__ == "__main__":
    main()
