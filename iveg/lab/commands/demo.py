"""The whole system on one machine: three processes, one address, one Ctrl-C.

The parts communicate only by MQTT and HTTP, so each can be killed and restarted by
itself.  They watch their standard input, and end when this process has ended.
"""

import asyncio
import secrets
import socket
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any
from urllib.parse import urlsplit

from iveg.adapters.equipment_files import DEMO
from iveg.adapters.fleet_files import load_fleet
from iveg.cli.arguments import CommandCall
from iveg.cli.running import LOOPBACK, print_sign_in_link, run_until_stopped
from iveg.domain.errors import SettingsError
from iveg.lab.commands.processes import running_parts
from iveg.ros2.names import namespace_of
from iveg.settings import Settings

_FIWARE = (
    ("mqtt_url", "IVEG_MQTT_URL", 1883),
    ("orion_url", "IVEG_ORION_URL", 80),
    ("iota_url", "IVEG_IOTA_URL", 80),
)
"""Setting of each address, its variable and its scheme's port."""


def run(call: CommandCall) -> int:
    """Run the demo; returns the exit code."""
    settings, environment = call.settings, call.environment
    directory = call.data / "demo"
    placed = replace(
        on_free_ports(settings, environment),
        sign_in_token=settings.sign_in_token or secrets.token_hex(32),
        notify_token=settings.notify_token or secrets.token_hex(32),
        data_directory=str(directory),
        equipment=settings.equipment or DEMO,
    )
    # Each demo starts anew: no hold of the last demo's robots remains.
    (directory / "commands.jsonl").unlink(missing_ok=True)
    parts = [["fiware"], ["serve", "--demo"]]
    if call.options.ros2:
        parts += ros2_parts(load_fleet(placed.fleet, placed.robots).ids)
    elif not call.options.no_emulator:
        parts.append(["emulator"])
    return run_until_stopped(
        _supervise(parts, placed, {**environment, **placed.to_environment()})
    )


def ros2_parts(robots: Sequence[str]) -> list[list[str]]:
    """ROS 2 robots on loopback, and an ``iveg robot`` for each."""
    place = ["--ros-domain", str(_free_domain()), "--ros-interface", "127.0.0.1"]
    place += ["--ros-peer", "127.0.0.1"]
    parts = [["emulator", "--dds", *place]]
    for robot in robots:
        name = f"/{namespace_of(robot)}"
        identity = ["--id", robot, "--namespace", name, "--attended"]
        parts.append(["robot", *identity, *place])
    return parts


def _free_domain() -> int:
    """A DDS domain whose first port is free on this machine.

    Raises:
        SettingsError: there is none.
    """
    # Not 0, the default of every other ROS 2 program.
    for domain in range(1, 100):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                # RTPS: 250 ports a domain, the first participant's own is the tenth.
                probe.bind(("127.0.0.1", 7400 + 250 * domain + 10))
            except OSError:
                continue
        return domain
    raise SettingsError("ROS_DOMAIN_ID", "any", "a DDS domain that is free")


def on_free_ports(settings: Settings, environment: Mapping[str, str]) -> Settings:
    """Move defaults whose port is taken to a free port; chosen addresses stay."""
    changes: dict[str, Any] = {
        "port": _free_port(environment, "IVEG_PORT", settings.host, settings.port)
    }
    for field, variable, default in _FIWARE:
        parts = urlsplit(getattr(settings, field))
        host = parts.hostname or ""
        if host not in LOOPBACK:
            raise SettingsError(variable, host, "an address on loopback")
        wanted = parts.port or default
        port = _free_port(environment, variable, host, wanted)
        if port != wanted:
            changes[field] = f"{parts.scheme}://{host}:{port}"
    return replace(settings, **changes)


def _free_port(
    environment: Mapping[str, str], variable: str, host: str, port: int
) -> int:
    """The port, or a free one in place of a default that is taken."""
    try:
        return bind_once(host, port)
    except OSError:
        if environment.get(variable):
            raise SettingsError(variable, str(port), "a port that is free") from None
        return bind_once(host, 0)


# --- processes --------------------------------------------------------------------


async def _supervise(
    parts: Sequence[Sequence[str]], settings: Settings, environment: Mapping[str, str]
) -> None:
    async with running_parts(environment) as running:
        for words in parts:
            await running.start(*words)
        print_sign_in_link(settings, settings.sign_in_token)
        await asyncio.gather(*(_watch(*part) for part in running.running))


async def _watch(name: str, process: asyncio.subprocess.Process) -> None:
    """Wait until a part ends; the others continue, as on a real site."""
    code = await process.wait()
    print(f"iveg: {name} has ended (exit code {code}).", file=sys.stderr, flush=True)


def bind_once(host: str, port: int) -> int:
    """Bind a port for a moment; returns it, or a free one for 0.

    Raises:
        OSError: it is taken, or the host is not of this machine.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((host, port))
        return int(probe.getsockname()[1])
