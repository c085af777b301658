"""A flood of wrong sign-ins: what STOP feels of it, and whether time tells names apart.

iVeg, a broker and two emulated robots are processes of their own.  Each turn presses
STOP on both robots without a flood and with one: sign-ins by names that are not there,
from ever new addresses of the loopback, so that no limit of an address ends it.  STOP's
time is from the request to the order on the broker.

    python -m benchmarks.sign_in_flood --turns 20
"""

import argparse
import asyncio
import contextlib
import itertools
import os
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import orjson

from benchmarks.process import machine, percentile, print_table
from benchmarks.stop import ROBOTS, Operator, running, until
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.adapters.passwords import Passwords

HEAD = ("sign-ins", "stops", "P50 ms", "P95 ms", "max ms")
AT_ONCE = 32
CHECKS = 60


class Orders:
    """When each order reached the broker, by its hold."""

    def __init__(self) -> None:
        self.at: dict[str, float] = {}

    def take(self, _: str, payload: bytes) -> None:
        """One command on its way to a robot."""
        told = orjson.loads(payload).get("cmd", {}).get("stop")
        if told is not None:
            self.at.setdefault(told["id"], time.monotonic())


class Flood:
    """Wrong sign-ins as fast as they are answered."""

    def __init__(self, url: str) -> None:
        self._host, self._port = httpx.URL(url).host, httpx.URL(url).port or 80
        self._addresses = itertools.count(256)

    async def run(self) -> None:
        """Until cancelled."""
        await asyncio.gather(*(self._guess() for _ in range(AT_ONCE)))

    async def _guess(self) -> None:
        body = b'{"name": "nobody", "password": "wrong-password"}'
        head = (
            f"POST /signin HTTP/1.1\r\nHost: {self._host}:{self._port}\r\n"
            "X-IVEG: 1\r\nSec-Fetch-Site: same-origin\r\nConnection: close\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
        )
        while True:
            number = next(self._addresses) % 2**16
            address = f"127.1.{number // 256}.{number % 256}"
            with contextlib.suppress(OSError):
                reader, writer = await asyncio.open_connection(
                    self._host, self._port, local_addr=(address, 0)
                )
                writer.write(head.encode() + body)
                await reader.readline()
                writer.close()
            await asyncio.sleep(0.02)


async def flooding(url: str) -> asyncio.subprocess.Process:
    """A process of its own, so that the clock of the measuring one is not held up."""
    program = (sys.executable, "-m", "benchmarks.sign_in_flood", "--flood", url)
    return await asyncio.create_subprocess_exec(*program)


async def press(browser: httpx.AsyncClient, orders: Orders, robot_id: str) -> float:
    """Seconds from the request to the order on the broker."""
    began = time.monotonic()
    answer = await browser.post(f"/api/v1/robots/{robot_id}/stop", json={})
    hold_id = answer.json()["command_id"]
    await until(lambda: hold_id in orders.at)
    return orders.at.get(hold_id, float("inf")) - began


async def measure(turns: int, folder: Path, parts: ExitStack) -> None:
    """The table of STOP."""
    took: dict[str, list[float]] = {"none": [], "flood": []}
    async with running(folder, "on", "embedded", parts) as (place, ear, (_, _)):
        orders, port = Orders(), urlsplit(place.settings["IVEG_MQTT_URL"]).port or 1883
        link = MqttLink(
            BrokerAddress("127.0.0.1", port), "flood", {"/iveg/+/cmd": 1}, orders.take
        )
        listening = asyncio.create_task(link.run())
        await until(lambda: link.connected)
        page = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
        async with httpx.AsyncClient(
            base_url=place.url, headers=page, timeout=10.0, trust_env=False
        ) as browser:
            await browser.post("/signin", json=place.proof)
            operator = Operator(browser, ear)
            for turn in range(2 * turns):
                for robot_id in ROBOTS:
                    await operator.free(robot_id)
                name = ("none", "flood")[turn % 2]
                guessing = await flooding(place.url) if turn % 2 else None
                await asyncio.sleep(1.0)
                for robot_id in ROBOTS:
                    took[name].append(await press(browser, orders, robot_id))
                if guessing is not None:
                    guessing.terminate()
                    await guessing.wait()
        listening.cancel()
    rows = [(name, sorted(1000.0 * one for one in all_)) for name, all_ in took.items()]
    cells = [
        (name, str(len(ms)), *(f"{one:.1f}" for one in _spread(ms)))
        for name, ms in rows
    ]
    print_table(f"STOP, request to broker ({machine()})", HEAD, cells)
    quiet, flooded = (percentile(ms, 0.95) for _, ms in rows)
    print(f"flood / none, P95: {flooded / quiet:.2f}")


def _spread(ms: list[float]) -> tuple[float, float, float]:
    return percentile(ms, 0.50), percentile(ms, 0.95), ms[-1]


async def tell_names_apart() -> None:
    """CPU of a name that is not there, beside that of a wrong password."""
    passwords = Passwords()
    kept = await passwords.hashed("right-password")
    await passwords.fits("", "")
    spent: dict[str, list[float]] = {"": [], kept: []}
    for _ in range(CHECKS):
        for one, all_ in spent.items():
            began = time.process_time()
            await passwords.fits("wrong-password", one)
            all_.append(1000.0 * (time.process_time() - began))
    passwords.close()
    name, password = (percentile(sorted(all_), 0.50) for all_ in spent.values())
    print(f"wrong name / wrong password, P50 of CPU: {name:.1f} / {password:.1f} ms")
    print(f"ratio: {name / password:.3f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=20)
    parser.add_argument("--flood", metavar="URL", help="guess there until ended")
    chosen = parser.parse_args()
    if chosen.flood:
        os.nice(10)
        asyncio.run(Flood(chosen.flood).run())
        return
    asyncio.run(tell_names_apart())
    with (
        tempfile.TemporaryDirectory(prefix="iveg-bench-") as folder,
        ExitStack() as parts,
    ):
        asyncio.run(measure(chosen.turns, Path(folder), parts))


if __name__ == "__main__":
    main()
