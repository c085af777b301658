"""What a notification costs `serve`: ``python -m benchmarks.notify_cost``.

CPU seconds per 1,000 of each kind: reading alone, and the whole way from the ASGI
server to the pipeline's queue, through the finished application.  The bodies are those
that Orion writes for a robot's odometry, a scan of 720 float32 and four boxes; ``old``
is a message that was overtaken, ``twin`` one that came before.
"""

import asyncio
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import orjson

from benchmarks.process import print_table
from iveg.app import App
from iveg.asgi import create_app
from iveg.ngsi.codec import read_notification
from iveg.settings import Settings

MESSAGES = 300
ROUNDS = 5
SUBSCRIPTION = "6743c1d2e4b0a1b2c3d4e5f6"
STAMP = "2026-11-20T14:13:07.754Z"


def attributes(kind: str, seq: int) -> dict[str, Any]:
    """What a robot's device sent."""
    origin = {"boot": "b00t", "seq": seq, "stamp": STAMP}
    draw = np.random.default_rng(seq)
    if kind == "odometry":
        x, y, yaw, v = (float(one) for one in draw.uniform(0, 5, 4))
        pose = {"x": x, "y": y, "yaw": yaw, "linear_velocity": v}
        return {"base_pose_ground_truth": pose | {"angular_velocity": 0.1} | origin}
    if kind == "scan":
        ranges = draw.uniform(0.1, 12.0, 720).astype(np.float32).astype(float)
        header = {
            "angle_min": -3.141592654,
            "angle_increment": 0.008726646,
            "range_min": 0.1,
            "range_max": 30.0,
            "x": 0.2,
            "y": 0.0,
            "yaw": 0.0,
        }
        return {"lidar_points": ranges.tolist(), "lidar_header": header | origin}
    boxes = [_box(*(float(one) for one in draw.uniform(0, 5, 2))) for _ in range(4)]
    return {"bounding_boxes": boxes, "detection_header": origin}


def _box(x: float, y: float) -> dict[str, Any]:
    place = {"xmin": x, "xmax": x + 0.5, "ymin": y, "ymax": y + 0.5}
    position = place | {"zmin": 0.0, "zmax": 1.7}
    return {"class_id": "farmer", "probability": 0.9412, "position": position}


def body(kind: str, seq: int) -> bytes:
    """The notification that Orion makes of it, normalized."""
    metadata = {"TimeInstant": {"type": "DateTime", "value": STAMP}}
    told = {
        name: {
            "type": "object",
            "value": value,
            "metadata": metadata,
        }
        for name, value in attributes(kind, seq).items()
    }
    entity = {"id": "AGI", "type": "Robot", **told}
    return orjson.dumps({"subscriptionId": SUBSCRIPTION, "data": [entity]})


def per_thousand(work: Callable[[bytes], object], bodies: Iterable[bytes]) -> float:
    """CPU seconds per 1,000 messages."""
    kept = list(bodies)
    began = time.process_time()
    for one in kept:
        work(one)
    return (time.process_time() - began) / len(kept) * 1000


class Line:
    """Stands for the server's side of one connection."""

    def __init__(self, app: Any, secret: str) -> None:
        self._app = app
        self._head = [
            (b"host", b"127.0.0.1:8000"),
            (b"user-agent", b"orion/4.7.0-next libcurl/7.88.1"),
            (b"fiware-service", b"agroconnect"),
            (b"fiware-servicepath", b"/greenhouse"),
            (b"accept", b"application/json"),
            (b"content-type", b"application/json; charset=utf-8"),
            (b"ngsiv2-attrsformat", b"normalized"),
            (b"x-iveg-notify-token", secret.encode()),
        ]
        self.statuses: set[int] = set()

    async def post(self, content: bytes) -> None:
        """One notification, as uvicorn hands it on."""
        scope = {
            "type": "http",
            "asgi": {"version": "3.0", "spec_version": "2.3"},
            "http_version": "1.1",
            "method": "POST",
            "scheme": "http",
            "path": "/ngsi/notifications",
            "raw_path": b"/ngsi/notifications",
            "query_string": b"",
            "root_path": "",
            "headers": [*self._head, (b"content-length", b"%d" % len(content))],
            "client": ("127.0.0.1", 40000),
            "server": ("127.0.0.1", 8000),
            "state": {},
        }

        async def receive() -> dict[str, Any]:
            return {"type": "http.request", "body": content, "more_body": False}

        async def send(message: dict[str, Any]) -> None:
            self.statuses.add(message.get("status", 204))

        await self._app(scope, receive, send)


async def whole_way(app: App, line: Line, bodies: list[bytes]) -> float:
    """CPU seconds per 1,000 messages, queue emptied outside the measure."""
    began = time.process_time()
    for one in bodies:
        await line.post(one)
    spent = (time.process_time() - began) / len(bodies) * 1000
    for received in app.pipeline.ingest.drain():
        app.core.world.apply(received)
    return spent


async def rows(app: App) -> list[list[str]]:
    app.provisioner.subscriptions.ids = frozenset({SUBSCRIPTION})
    line = Line(create_app(app), app.notify_secret)
    table = []
    for kind in ("odometry", "scan", "detections"):
        best: dict[str, float] = {}
        for turn in range(ROUNDS):
            first = 1 + turn * 10 * MESSAGES
            fresh = [body(kind, first + n) for n in range(MESSAGES)]
            cases = {"read": per_thousand(read_notification, fresh)}
            cases["whole"] = await whole_way(app, line, fresh)
            cases["twin"] = await whole_way(app, line, fresh)
            for name, spent in cases.items():
                best[name] = min(spent, best.get(name, spent))
        table.append([kind, *(f"{spent:.3f}" for spent in best.values())])
    if line.statuses != {204}:
        raise SystemExit(f"not all were taken: {line.statuses}")
    return table


def main() -> None:
    with TemporaryDirectory() as directory:
        app = App(Settings(), Path(directory))
        told = asyncio.run(rows(app))
    head = ("kind", "reading", "whole way", "the same of a twin")
    print_table("CPU seconds per 1,000 notifications", head, told)


if __name__ == "__main__":
    main()
