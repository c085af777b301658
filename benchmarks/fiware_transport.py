"""Speed of the embedded FIWARE: MQTT publish → notification received.

``python -m benchmarks.fiware_transport [--robots 2 20 …] [--seconds 6]``: each robot
sends odometry, a 720-beam scan and two boxes at 30 Hz.  The embedded FIWARE, the robots
and the receiver are three processes; what each costs is told, so that one sees who was
the limit.  ``--profile FILE`` writes where the embedded process spends its time.
"""

import argparse
import asyncio
import cProfile
import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import uvloop

from benchmarks.fiware_ends import HOST
from benchmarks.process import Usage, machine, pause, percentile, print_table
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.orion import OrionClient
from iveg.adapters.reconciler import (
    FiwareSite,
    ensure_subscriptions,
    provision,
    wanted_for,
)
from iveg.lab.embedded.server import embedded_fiware

TENANT = ("agroconnect", "/greenhouse")
_DRAIN_S = 1.5
_HEAD = (
    *("robots", "measures/s", "P50 ms", "P95 ms", "P99 ms", "max ms", "lost"),
    *(
        "FIWARE CPU %",
        "µs a measure",
        "receiver CPU %",
        "sender CPU %",
        "sender late ms",
    ),
)


async def _serve(profile: str) -> None:
    async with embedded_fiware() as up:
        print(up.mqtt_port, up.orion_url, up.iota_url, flush=True)
        profiler = cProfile.Profile()
        if profile:
            profiler.enable()
        # Ends with its input, so that the profile is written.
        await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
        if profile:
            profiler.disable()
            profiler.dump_stats(profile)


@contextmanager
def _child(*words: str) -> Iterator["subprocess.Popen[str]"]:
    command = [sys.executable, "-m", *words]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.stdin.close()  # type: ignore[union-attr]
            if words[-1] == "receive":
                process.terminate()
            process.wait(10)


def _said(process: "subprocess.Popen[str]") -> list[str]:
    line = process.stdout.readline()  # type: ignore[union-attr]
    return list(line.split())


async def _prepare(orion_url: str, iota_url: str, notify_port: str, most: int) -> None:
    async with (
        OrionClient(orion_url, *TENANT) as orion,
        IotAgentClient(iota_url, *TENANT) as agent,
    ):
        robots = [f"R{index}" for index in range(most)]
        await provision(agent, orion, FiwareSite(robots, "iveg", orion_url))
        url = f"http://{HOST}:{notify_port}/ngsi/notifications"
        await ensure_subscriptions(orion, url, "ab" * 16, wanted_for())


def _run(
    robots: int, seconds: float, fiware: int, receiver: int, ports: tuple[str, str]
) -> list[str]:
    """One fleet for a while: one row."""
    before = Usage.of(fiware), Usage.of(receiver)
    words = ("send", ports[0], str(robots), str(seconds))
    ended = subprocess.run(
        [sys.executable, "-m", "benchmarks.fiware_ends", *words],
        capture_output=True,
        check=True,
    )
    sent = json.loads(ended.stdout)
    pause(_DRAIN_S)
    after = Usage.of(fiware), Usage.of(receiver)
    used = [now.cpu_s - then.cpu_s for now, then in zip(after, before, strict=True)]
    url = f"http://{HOST}:{ports[1]}/"
    ages = sorted(one / 1e3 for one in httpx.get(url, trust_env=False).json())
    spent = sent["spent_s"]
    return [
        str(robots),
        f"{sent['count'] / spent:.0f}",
        *(f"{percentile(ages, share):.2f}" for share in (0.5, 0.95, 0.99, 1.0)),
        str(sent["count"] - len(ages)),
        f"{100 * used[0] / spent:.0f}",
        f"{1e6 * used[0] / sent['count']:.0f}",
        f"{100 * used[1] / spent:.0f}",
        f"{100 * sent['cpu_s'] / spent:.0f}",
        f"{1e3 * sent['latest_s']:.1f}",
    ]


def run(fleets: list[int], seconds: float, profile: str) -> None:
    """Print the table."""
    serve = "--serve", "--profile", profile
    with (
        _child("benchmarks.fiware_transport", *serve) as fiware,
        _child("benchmarks.fiware_ends", "receive") as receiver,
    ):
        mqtt, orion, iota = _said(fiware)
        (notify,) = _said(receiver)
        asyncio.run(_prepare(orion, iota, notify, max(fleets)))
        rows = [
            _run(robots, seconds, fiware.pid, receiver.pid, (mqtt, notify))
            for robots in fleets
        ]
    print_table(f"Embedded FIWARE ({machine()})", _HEAD, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--robots", type=int, nargs="+", default=[2, 5, 10, 20, 25, 30, 35, 40]
    )
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--profile", default="")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.serve:
        uvloop.run(_serve(chosen.profile))
    else:
        run(chosen.robots, chosen.seconds, chosen.profile)


if __name__ == "__main__":
    main()
