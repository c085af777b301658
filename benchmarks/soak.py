"""Minutes of driving: nothing is lost on the way and nothing grows.

``python -m benchmarks.soak [MINUTES]`` (10).  For each kind of message, what the broker
passed on is what iVeg took from Orion (with ``IVEG_DIRECT_READ=safety``, so that Orion
leaves nothing out); what robots numbered and sent on no topic was overtaken by newer
messages of their own, which is rare and never befalls a safety report.
The memory of every program must be flat and all of iVeg must fit in one core.  Exit
status 1 where one of these does not hold.
"""

import asyncio
import json
import socket
import sys
import tempfile
from collections import Counter, defaultdict
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path

import aiomqtt

from benchmarks.process import Usage, machine, print_table
from iveg.adapters.mqtt import BrokerAddress
from tests.processes import Site, site

KINDS = {
    "_odom": ("base_pose_ground_truth", "fiware.Odometry"),
    "_lidar2D": ("lidar_header", "fiware.LaserScan"),
    "_yolox_bounding_boxes": ("detection_header", "fiware.DetectionFrame"),
    "_safety": ("safety_state", "fiware.SafetyReport"),
}
"""Device suffix → attribute with the robot's own count, counter at the dashboard."""

MOST_CORES = 1.0
MOST_GROWTH_MIB = 8.0
_MOST_OVERTAKEN = 0.01
_SETTLE_S = 3.0


@dataclass
class Heard:
    """What one listener at the broker counted.

    Attributes:
        messages: By device suffix; ``direct`` those for iVeg alone.
        numbers: First and last number of each robot's topic.
    """

    messages: Counter[str] = field(default_factory=Counter)
    direct: Counter[str] = field(default_factory=Counter)
    numbers: dict[tuple[str, str], tuple[int, int]] = field(default_factory=dict)

    def take(self, topic: str, payload: bytes) -> None:
        """Count one message."""
        _, first, second, last = topic.split("/")
        if second == "iveg":
            self._count(f"{first}_{last}", payload, self.direct)
        else:
            self._count(second, payload, self.messages)

    def _count(self, device: str, payload: bytes, messages: Counter[str]) -> None:
        suffix = next((known for known in KINDS if device.endswith(known)), None)
        if suffix is None:
            return
        messages[suffix] += 1
        number = int(json.loads(payload)[KINDS[suffix][0]]["seq"])
        first, last = self.numbers.get((device, suffix), (number, number))
        self.numbers[device, suffix] = (min(first, number), max(last, number))

    def numbered(self) -> dict[str, int]:
        """How many messages the robots themselves counted, by device suffix."""
        total: dict[str, int] = defaultdict(int)
        for (_, suffix), (first, last) in self.numbers.items():
            total[suffix] += last - first + 1
        return total


@dataclass(frozen=True, slots=True)
class Sample:
    """Memory of each program (MiB) and processor time of all (s) at one moment."""

    minute: float
    rss_mib: dict[str, float]
    cpu_s: float


def main() -> None:
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    with tempfile.TemporaryDirectory() as directory, _site(directory) as place:
        place.start("fiware").wait_until_ready()
        place.start("serve")
        place.wait_until_whole()
        heard, samples = asyncio.run(_run(place, minutes))
        with place.api() as api:
            counters = api.get("health").json()["counters"]
    failures = _report(heard, counters, samples, minutes)
    for failure in failures:
        print(f"FAILED: {failure}")
    sys.exit(1 if failures else 0)


def _site(directory: str) -> AbstractContextManager[Site]:
    return site(Path(directory), IVEG_DIRECT_READ="safety")


async def _run(place: Site, minutes: float) -> tuple[Heard, list[Sample]]:
    """Listen first, then start the robots, so that both ends see every message."""
    heard = Heard()
    broker = BrokerAddress.from_url(place.settings["IVEG_MQTT_URL"])
    nodelay = [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)]
    async with aiomqtt.Client(
        broker.host, broker.port, socket_options=nodelay
    ) as client:
        await client.subscribe("/+/+/attrs", qos=0)
        await client.subscribe("/+/iveg/+", qos=0)
        listener = asyncio.create_task(_listen(client, heard))
        emulator = place.start("emulator")
        samples = []
        for tick in range(1, 21):
            await asyncio.sleep(3 * minutes)
            samples.append(_sample(place, tick * minutes / 20))
        await asyncio.to_thread(emulator.interrupt)
        await asyncio.sleep(_SETTLE_S)
        listener.cancel()
    return heard, samples


async def _listen(client: aiomqtt.Client, heard: Heard) -> None:
    async for message in client.messages:
        if isinstance(message.payload, bytes):
            heard.take(str(message.topic), message.payload)


def _sample(place: Site, minute: float) -> Sample:
    usages = {program.words[0]: Usage.of(program.pid) for program in place.programs}
    rss = {name: usage.rss_mib for name, usage in usages.items()}
    return Sample(minute, rss, sum(usage.cpu_s for usage in usages.values()))


def _report(
    heard: Heard, counters: dict[str, int], samples: list[Sample], minutes: float
) -> list[str]:
    return [*_report_messages(heard, counters, minutes), *_report_cost(samples)]


def _report_messages(
    heard: Heard, counters: dict[str, int], minutes: float
) -> list[str]:
    failures = []
    rows = []
    numbered = heard.numbered()
    for suffix, (_, counter) in KINDS.items():
        sent, taken = heard.messages[suffix], counters.get(counter, 0)
        # Every report goes to iVeg's own topic, of the rest what the agent is spared.
        on_way = 0 if suffix == "_safety" else sent
        overtaken = numbered[suffix] - heard.direct[suffix] - on_way
        counts = (numbered[suffix], overtaken, sent, taken)
        rows.append([suffix[1:], *map(str, counts)])
        if sent != taken or sent == 0:
            failures.append(f"{suffix[1:]}: {sent} at the broker, {taken} at iVeg")
        if overtaken > _MOST_OVERTAKEN * sent:
            failures.append(f"{suffix[1:]}: robots overtook {overtaken} of their own")
    if numbered["_safety"] != heard.direct["_safety"]:
        failures.append("a safety report never reached the broker")
    head = ["measure", "numbered", "overtaken on robot", "at the broker", "at iVeg"]
    print_table(f"Messages in {minutes:g} min ({machine()})", head, rows)
    return failures


def _report_cost(samples: list[Sample]) -> list[str]:
    # The first quarter fills caches and trails; growth is what comes after it.
    settled, last = samples[len(samples) // 4], samples[-1]
    failures = [
        f"{name} grew by {last.rss_mib[name] - before:.1f} MiB"
        for name, before in settled.rss_mib.items()
        if last.rss_mib[name] - before > MOST_GROWTH_MIB
    ]
    cores = (last.cpu_s - settled.cpu_s) / (60 * (last.minute - settled.minute))
    print_table(
        "What it costs",
        ["", "from", "to", "limit"],
        [
            *(
                [
                    f"{name} RSS, MiB",
                    f"{before:.1f}",
                    f"{last.rss_mib[name]:.1f}",
                    f"+{MOST_GROWTH_MIB:g}",
                ]
                for name, before in settled.rss_mib.items()
            ),
            ["all of iVeg, cores", "", f"{cores:.2f}", f"{MOST_CORES:g}"],
        ],
    )
    if cores > MOST_CORES:
        failures.append(f"{cores:.2f} cores")
    return failures


if __name__ == "__main__":
    main()
