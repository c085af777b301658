"""From a press to a latched robot, by transport, idle and under ten times the load.

Every part is a process of its own: Mosquitto with the embedded FIWARE bridged to it, or
the embedded broker alone (``--broker embedded``), iVeg, and two emulated robots.  A
press is an HTTP request; a robot has latched when its own answer is on the broker,
which is after its wheels were told to stand and its hold is on disk.  The load is
odometry of robots that are in the fleet and nowhere else, nine times as many messages
as everybody else sends.

    python -m benchmarks.stop --stops 100
"""

import argparse
import asyncio
import tempfile
import time
from collections.abc import AsyncIterator, Callable
from contextlib import ExitStack, asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import orjson

from benchmarks.process import machine, percentile, print_table
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.ngsi import codec
from tests.brokers import MOSQUITTO
from tests.chaos.field import Field
from tests.processes import Site, site

ROBOTS = ("AGI", "AGII")
CROWD = tuple(f"L{number}" for number in range(1, 19))
LOAD = 9
PATIENCE_S = 20.0
HEAD = ("transport, load", "stops", "confirmed", "P50 ms", "P95 ms", "max ms")


@dataclass
class Ear:
    """Hears robots answer, and counts what everybody says."""

    latched: dict[str, float] = field(default_factory=dict)
    messages: int = 0

    def take(self, topic: str, payload: bytes) -> None:
        """One message of the broker."""
        at = time.monotonic()
        if not topic.endswith("/cmdexe"):
            self.messages += 1
            return
        for answer in codec.read_answer(topic.split("/")[2], payload).observations:
            hold_id = getattr(answer, "id", None)
            if hold_id is not None and getattr(answer, "result", "") == "LATCHED":
                self.latched.setdefault(hold_id, at)


@dataclass(frozen=True)
class Row:
    """What one transport did under one load."""

    name: str
    took: list[float]
    confirmed: int

    def cells(self) -> tuple[str, ...]:
        """As the table shows it."""
        took = sorted(1000.0 * one for one in self.took) or [float("nan")]
        return (
            self.name,
            str(len(self.took)),
            str(self.confirmed),
            f"{percentile(took, 0.50):.1f}",
            f"{percentile(took, 0.95):.1f}",
            f"{took[-1]:.1f}",
        )


async def until(true: Callable[[], object], within_s: float = PATIENCE_S) -> bool:
    deadline = time.monotonic() + within_s
    while not true():
        if time.monotonic() > deadline:
            return False
        await asyncio.sleep(0.01)
    return True


class Operator:
    """Presses and releases as a page does."""

    def __init__(self, browser: httpx.AsyncClient, ear: Ear) -> None:
        self._browser = browser
        self._ear = ear

    async def look(self, robot_id: str) -> Any:
        """What the page says of a robot."""
        return (await self._browser.get(f"/api/v1/robots/{robot_id}")).json()

    async def reaches(self, robot_id: str, *states: str) -> bool:
        """Whether the robot is in one of these states before patience ends."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            if (await self.look(robot_id))["stop_state"] in states:
                return True
            await asyncio.sleep(0.02)
        return False

    async def free(self, robot_id: str) -> bool:
        """Release what holds it; it may wait for its resume."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            robot = await self.look(robot_id)
            if robot["stop_state"] in ("READY", "RUNNING") and not robot["holds"]:
                return True
            holds = [hold["id"] for hold in robot["holds"]]
            if robot["stop_state"] in ("STANDING", "RUNNING"):
                path = f"/api/v1/robots/{robot_id}/release"
                await self._browser.post(path, json={"holds": holds})
            await asyncio.sleep(0.05)
        return False

    async def stop(self, robot_id: str) -> tuple[float, bool]:
        """Seconds to the robot's answer, and whether it was seen to stand."""
        await self.free(robot_id)
        began = time.monotonic()
        answer = await self._browser.post(f"/api/v1/robots/{robot_id}/stop", json={})
        hold_id = answer.json()["command_id"]
        await until(lambda: hold_id in self._ear.latched)
        took = self._ear.latched.get(hold_id, float("inf")) - began
        return took, await self.reaches(robot_id, "STANDING")


async def crowd(link: MqttLink, rate: float) -> None:
    """So many messages a second from robots that are not there, until cancelled."""
    began, sent = time.monotonic(), 0
    while True:
        due = int(rate * (time.monotonic() - began))
        for number in range(sent, due):
            name, seq = CROWD[number % len(CROWD)], number // len(CROWD)
            pose = {"x": 1.0, "y": 2.0, "yaw": 0.0, "linear_velocity": 0.0}
            origin = {"boot": "load", "seq": seq, "angular_velocity": 0.0}
            body = orjson.dumps({"base_pose_ground_truth": {**pose, **origin}})
            await link.publish(f"/iveg/{name}_odom/attrs", body, qos=0)
        sent = due
        await asyncio.sleep(0.01)


async def measure(
    name: str, stops: int, operator: Operator, link: MqttLink, rate: float
) -> Row:
    """Stop the two robots by turns, with so much load beside it."""
    load = asyncio.create_task(crowd(link, rate))
    # The chain fills up before anything is measured.
    await asyncio.sleep(3.0)
    share = (stops + 1) // len(ROBOTS)

    async def by_turns(robot_id: str) -> list[tuple[float, bool]]:
        return [await operator.stop(robot_id) for _ in range(share)]

    turns = await asyncio.gather(*map(by_turns, ROBOTS))
    load.cancel()
    took = [one for turn in turns for one, _ in turn]
    return Row(name, took, sum(stands for turn in turns for _, stands in turn))


def start(place: Site, broker: str, parts: ExitStack) -> None:
    """Start every part; what is not a program of the place ends with ``parts``."""
    robots = ("--robots", str(len(ROBOTS)))
    if broker == "mosquitto":
        field_ = Field(place, *robots)
        parts.callback(field_.close)
        for part in ("broker", "fiware", "serve", "emulator"):
            field_.start(part)
        return
    place.start("fiware").wait_until_ready()
    place.start("serve")
    place.wait_until_served()
    place.start("emulator", *robots)


async def messages_of(place: Site, seconds: float = 3.0) -> float:
    """How many measures a second everybody sends."""
    ear = Ear()
    port = urlsplit(place.settings["IVEG_MQTT_URL"]).port or 1883
    address = BrokerAddress("127.0.0.1", port)
    link = MqttLink(address, "count", {"/iveg/+/attrs": 0}, ear.take)
    listening = asyncio.create_task(link.run())
    await until(lambda: link.connected)
    before = ear.messages
    await asyncio.sleep(seconds)
    listening.cancel()
    await asyncio.gather(listening, return_exceptions=True)
    return (ear.messages - before) / seconds


@asynccontextmanager
async def running(
    directory: Path, direct: str, broker: str, parts: ExitStack
) -> AsyncIterator[tuple[Site, Ear, Any]]:
    """The stack with its ear and an operator at its page."""
    names = ",".join((*ROBOTS, *CROWD))
    with site(directory, IVEG_ROBOTS=names, IVEG_STOP_DIRECT=direct) as place:
        start(place, broker, parts)
        place.wait_until_live(len(ROBOTS))
        ear = Ear()
        port = urlsplit(place.settings["IVEG_MQTT_URL"]).port or 1883
        topics = {"/iveg/+/cmdexe": 1}
        link = MqttLink(BrokerAddress("127.0.0.1", port), "bench", topics, ear.take)
        listening = asyncio.create_task(link.run())
        await until(lambda: link.connected)
        page = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
        async with httpx.AsyncClient(
            base_url=place.url, headers=page, timeout=10.0, trust_env=False
        ) as browser:
            await browser.post("/signin", json=place.proof)
            yield place, ear, (Operator(browser, ear), link)
        listening.cancel()
        await asyncio.gather(listening, return_exceptions=True)


async def run(stops: int, broker: str) -> None:
    rows: list[Row] = []
    for transport in ("direct", "fiware"):
        with (
            tempfile.TemporaryDirectory(prefix="iveg-bench-") as folder,
            ExitStack() as parts,
        ):
            rows += await measure_transport(
                transport, stops, Path(folder), broker, parts
            )
    title = f"Press to latched over {broker} ({machine()})"
    print_table(title, HEAD, [row.cells() for row in rows])
    first, second = (sorted(row.took) for row in rows[:2])
    for share in (0.50, 0.95):
        ratio = percentile(second, share) / percentile(first, share)
        print(f"direct, loaded / idle, P{share:.0%}".rstrip("%"), f"{ratio:.2f}")
    confirmed = sum(row.confirmed for row in rows)
    print(f"confirmed: {confirmed} of {sum(len(row.took) for row in rows)}")


async def measure_transport(
    transport: str, stops: int, folder: Path, broker: str, parts: ExitStack
) -> list[Row]:
    """One transport, idle and under the load."""
    direct = "on" if transport == "direct" else "off"
    async with running(folder, direct, broker, parts) as (place, _, (operator, link)):
        idle = await measure(f"{transport}, idle", stops, operator, link, 0.0)
        rate = LOAD * await messages_of(place)
        name = f"{transport}, +{rate:.0f} msg/s"
        return [idle, await measure(name, stops, operator, link, rate)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=100, help="a transport and load")
    brokers = ("mosquitto", "embedded")
    usual = brokers[MOSQUITTO is None]
    parser.add_argument("--broker", choices=brokers, default=usual)
    chosen = parser.parse_args()
    asyncio.run(run(chosen.stops, chosen.broker))


if __name__ == "__main__":
    main()
