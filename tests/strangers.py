"""Robots that a test speaks for over MQTT, honestly or not, and what they are told.

They know nothing of iVeg's code: each message is written by hand, as
docs/interfaces/mqtt.md says.
"""

import asyncio
import json
import math
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import aiomqtt

from tests.patience import PATIENCE_S

Json = dict[str, Any]
HZ = 10.0
APIKEY = "iveg"


def stamp_of(unix_s: float) -> str:
    """As robots write it."""
    told = datetime.fromtimestamp(unix_s, UTC).isoformat(timespec="milliseconds")
    return told.replace("+00:00", "Z")


def box_about(
    x: float, y: float, class_id: str = "person", probability: float = 0.95
) -> Json:
    """One box in ``map``."""
    sides = {"xmin": x - 0.2, "xmax": x + 0.2, "ymin": y - 0.2, "ymax": y + 0.2}
    return {
        "class_id": class_id,
        "probability": probability,
        "frame_id": "map",
        "position": {**sides, "zmin": 0.0, "zmax": 1.7},
    }


@dataclass
class Stranger:
    """One robot that stands still; it does not echo feedback.

    Attributes:
        boxes: What it sees; None: its detector says nothing.
        spoil: What becomes of a detection payload before it leaves.
        detector_off_s: How far its detector's clock is off (s).
    """

    robot_id: str
    x: float
    y: float
    boxes: list[Json] | None = field(default_factory=list)
    spoil: Callable[[Json], str | bytes] = json.dumps
    detector_off_s: float = 0.0
    boot: str = "stranger"
    seq: int = 0

    def messages(self) -> list[tuple[str, str | bytes]]:
        """What it says now, by topic."""
        self.seq += 1
        pose = {"x": self.x, "y": self.y, "yaw": 0.0}
        twist = {"linear_velocity": 0.0, "angular_velocity": 0.0}
        odometry = {"base_pose_ground_truth": {**pose, **twist, **self._origin(0.0)}}
        told: list[tuple[str, str | bytes]] = [
            (f"/{APIKEY}/{self.robot_id}_odom/attrs", json.dumps(odometry))
        ]
        if self.boxes is not None:
            seen = {
                "bounding_boxes": self.boxes,
                "detection_header": self._origin(self.detector_off_s),
            }
            topic = f"/{APIKEY}/{self.robot_id}_yolox_bounding_boxes/attrs"
            told.append((topic, self.spoil(seen)))
        return told

    def _origin(self, off_s: float) -> Json:
        stamp = stamp_of(time.time() + off_s)
        return {"boot": self.boot, "seq": self.seq, "stamp": stamp}


@dataclass
class Field:
    """Strangers on one broker, and the newest limits that the fleet was told."""

    robots: list[Stranger]
    limits: Json = field(default_factory=dict)
    clear: list[str] = field(default_factory=list)

    def factor(self, robot_id: str) -> float:
        """As a robot must read it: unnamed is no more than half."""
        if robot_id in self.clear:
            return 1.0
        return float(self.limits.get(robot_id, {"speed_factor": 0.5})["speed_factor"])

    async def until(self, holds: Callable[[], object], what: str) -> None:
        """Wait for something that the fleet is told."""
        deadline = time.monotonic() + PATIENCE_S
        while not holds():
            assert time.monotonic() < deadline, f"{what}: {self.limits} {self.clear}"
            await asyncio.sleep(0.02)


@asynccontextmanager
async def strangers(mqtt_url: str, *robots: Stranger) -> AsyncIterator[Field]:
    """Let robots speak at ``HZ`` while the block runs."""
    place = Field(list(robots))
    host, _, port = mqtt_url.removeprefix("mqtt://").partition(":")
    async with aiomqtt.Client(host, int(port)) as client:
        await client.subscribe("/+/mqtt_feedback", qos=1)
        tasks = [
            asyncio.create_task(_speak(client, place)),
            asyncio.create_task(_listen(client, place)),
        ]
        try:
            yield place
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


async def _speak(client: aiomqtt.Client, place: Field) -> None:
    began = time.monotonic()
    while True:
        for robot in place.robots:
            for topic, payload in robot.messages():
                await client.publish(topic, payload, qos=1)
        now = (time.monotonic() - began) * HZ
        await asyncio.sleep((math.floor(now) + 1 - now) / HZ)


async def _listen(client: aiomqtt.Client, place: Field) -> None:
    async for message in client.messages:
        assert isinstance(message.payload, bytes)
        told = json.loads(message.payload)
        place.limits, place.clear = told["speed_limits"], told["clear"]
