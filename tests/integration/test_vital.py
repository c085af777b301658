"""Real processes: a drawing ends nothing, and a vital part does not end in silence."""

import asyncio
import math
from collections.abc import Iterator
from typing import Any

import httpx
import orjson
import pytest

from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.observations import Origin
from iveg.ngsi import codec, names
from tests.builders import odometry, scan
from tests.integration.doomed import DOOM
from tests.processes import Site, until
from tests.threads import running

ROBOTS = ("AGI", "AGII")


class Field:
    """Two robots that only send, and what they are told."""

    def __init__(self, site: Site) -> None:
        self.told: dict[str, dict[str, Any]] = {}
        self.stopped: set[str] = set()
        self.seq = 0
        filters = {"/+/mqtt_feedback": 1, "/+/iveg/desired": 1}
        address = BrokerAddress.from_url(site.settings["IVEG_MQTT_URL"])
        self.link = MqttLink(address, "field", filters, self._hear)

    def _hear(self, topic: str, payload: bytes) -> None:
        robot_id = topic.split("/")[1]
        if topic.endswith("/mqtt_feedback"):
            self.told[robot_id] = orjson.loads(payload)
        elif b"stopped" in payload:
            self.stopped.add(robot_id)

    def say(self, robot_id: str, suffix: str, payload: bytes) -> None:
        self.link.enqueue(names.direct_topic(robot_id, suffix), payload)

    async def drive(self) -> None:
        """Poses of both at 20 Hz, and scans of AGI whose rays have no angle."""
        while True:
            self.seq += 1
            for x, robot_id in enumerate(ROBOTS):
                at = Origin(f"boot-{robot_id}", self.seq)
                pose = odometry(robot_id, 10.0 + 30.0 * x, 10.0, origin=at)
                self.say(robot_id, "_odom", codec.write_measure(pose))
            at = Origin("boot-AGI", self.seq)
            flat = scan("AGI", [3.0] * 90, angle_increment=0.0, origin=at)
            self.say("AGI", "_lidar2D", codec.write_measure(flat))
            good = scan("AGII", [3.0] * 90, angle_increment=math.tau / 90)
            self.say("AGII", "_lidar2D", codec.write_measure(good))
            await asyncio.sleep(0.05)

    async def live(self) -> None:
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self.link.run())
            tasks.create_task(self.drive())

    def reasons(self, robot_id: str) -> set[str]:
        """Why the newest feedback of an observer slows robots."""
        limits = self.told[robot_id]["speed_limits"].values()
        return {one["reason"] for one in limits if one["speed_factor"] == 0.5}


@pytest.fixture
def field(fiware: Site) -> Iterator[Field]:
    field = Field(fiware)
    with running(field.live(), "field"):
        yield field


def test_f60_f61_f62_a_drawing_ends_nothing_and_a_vital_part_not_in_silence(
    fiware: Site, field: Field
) -> None:
    server = fiware.start("serve", module="tests.integration.doomed")
    fiware.wait_until_served()
    with fiware.api() as api:
        metrics = f"{fiware.url}/metrics"
        until(lambda: "rejected." in api.get(metrics).text, "a refusal")
        until(lambda: _keys(api) >= {"alert.part_down"}, "the alert")
        until(lambda: api.get("costmap").status_code == 200, "the costmap")
        stopped = api.post("robots/AGII/stop")
        until(lambda: "AGII" in field.stopped, "the STOP of AGII")

    assert server.process.poll() is None
    assert stopped.status_code == 202

    (fiware.directory / DOOM).touch()

    assert server.process.wait(30.0) == 1
    until(lambda: field.reasons("AGI") == {"unsupervised"}, "the last feedback", 5.0)


def _keys(api: httpx.Client) -> set[str]:
    return {one["key"] for one in api.get("alerts?limit=10").json()["items"]}
