"""The parts as processes: serve, fiware, emulator, replay."""

import argparse
import asyncio
import contextlib
import logging
import os
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import uvicorn

from iveg.adapters import clock
from iveg.adapters.extras import require_extra
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.history.engine import sqlite_url
from iveg.adapters.history.migrate import upgrade
from iveg.adapters.iot_agent import IotAgentClient, provision
from iveg.adapters.orion import OrionClient
from iveg.app import Dss, broker_of
from iveg.asgi import create_app
from iveg.cli.memory import settle_memory
from iveg.cli.running import LOOPBACK, run_until_told, tell_link, tell_ready
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.fleet import FleetDescription
from iveg.settings import Settings
from iveg.web.live.bounded import BoundedSocket
from iveg.web.prompt import prompt_http

if TYPE_CHECKING:
    from iveg.adapters.dds import Dds
    from iveg.emulator.truth import TruthLog

_log = logging.getLogger(__name__)
_LIVE_ROBOT_S = 10.0
_WS_MAX_BYTES = 65536


def run_part(options: argparse.Namespace, settings: Settings, data: Path) -> int:
    """Run one part until it is ended; returns the exit code."""
    match options.command:
        case "serve":
            data.mkdir(parents=True, exist_ok=True)
            work = serve(settings, data, demo=options.demo)
        case "fiware":
            work = fiware(settings)
        case "emulator":
            work = emulator(options, settings)
        case _:
            work = replay(options, settings)
    return run_until_told(work, until_eof=options.until_eof)


# --- the DSS ----------------------------------------------------------------------


class _Server(uvicorn.Server):
    """A server that leaves signals to ``run_until_told``, as all parts do."""

    def __init__(self, config: uvicorn.Config, on_start: Callable[[], None]) -> None:
        super().__init__(config)
        self._on_start = on_start

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._on_start()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


async def serve(settings: Settings, data: Path, *, demo: bool) -> None:
    """The decision-support system with its page."""
    await _upgrade_history(settings, data)
    dss = Dss(settings, data, demo=demo)
    app = create_app(dss)
    server = _Server(
        uvicorn.Config(
            app,
            http=prompt_http(app.state.orion),
            host=settings.host,
            port=settings.port,
            log_config=None,
            access_log=False,
            ws=BoundedSocket,
            ws_max_size=_WS_MAX_BYTES,
            ws_ping_interval=10.0,
            ws_ping_timeout=10.0,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=2,
            server_header=False,
        ),
        on_start=tell_ready if demo else lambda: _print_link(settings, dss),
    )
    settle_memory()
    dss.on_failure = lambda: setattr(server, "should_exit", True)
    serving = asyncio.create_task(server.serve(), name="http")
    try:
        await asyncio.shield(serving)
    except asyncio.CancelledError:
        server.should_exit = True
        await serving


async def _upgrade_history(settings: Settings, data: Path) -> None:
    """Upgrade the history; a newer or broken database ends the start."""
    try:
        await asyncio.to_thread(upgrade, _database_url(settings, data))
    except HopError as error:
        _log.warning("the history starts without its database: %s", error)


def _database_url(settings: Settings, data: Path) -> str:
    return settings.database_url or sqlite_url(data / "iveg.sqlite")


def _print_link(settings: Settings, dss: Dss) -> None:
    tell_link(settings, dss.sign_in_token)


# --- FIWARE, robots, recordings ---------------------------------------------------


async def fiware(settings: Settings) -> None:
    """The embedded MQTT broker, Orion and IoT Agent."""
    require_extra("demo", "iveg fiware")
    from iveg.embedded.server import serve_fiware

    settle_memory()
    await serve_fiware(
        _address(settings.mqtt_url, 1883),
        _address(settings.orion_url, 1026),
        _address(settings.iota_url, 4041),
        notify_ready=tell_ready,
    )


async def emulator(options: argparse.Namespace, settings: Settings) -> None:
    """Simulated robots, people and climate."""
    from iveg.emulator.fleet import run_emulator
    from iveg.emulator.orders import read_translations

    fleet = load_fleet(settings.fleet, settings.robots)
    robots = [one.robot_id for one in fleet.members.values() if one.kind == "live"]
    if options.robots is not None:
        more = range(len(robots) + 1, options.robots + 1)
        robots = [*robots, *(f"AG{number}" for number in more)][: options.robots]
    with (
        TemporaryDirectory(prefix="iveg-robots-") as directory,
        _network(options) as network,
        _truth(options.truth) as truth,
    ):
        running = asyncio.create_task(
            run_emulator(
                robots=robots,
                address=broker_of(settings),
                apikey=settings.apikey,
                greenhouse=load_greenhouse(settings.greenhouse),
                scenario=options.scenario,
                seed=options.seed,
                profile=options.profile,
                uplink=settings.uplink,
                slow_s=settings.feedback_slow_s,
                stand_s=settings.feedback_stand_s,
                state_directory=Path(directory),
                held=options.held,
                rate_hz=options.hz,
                faults=read_translations(options.fault, robots),
                fault_port=options.fault_port,
                network=network,
                description=fleet,
                truth=truth,
                camera=options.camera,
            ),
            name="emulator",
        )
        tell_ready()
        try:
            await running
        finally:
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)


@contextlib.contextmanager
def _truth(file: Path | None) -> "Iterator[TruthLog | None]":
    """Log of the targets really in view, if requested."""
    if file is None:
        yield None
        return
    from iveg.emulator.truth import TruthLog

    with contextlib.closing(TruthLog(file)) as log:
        yield log


@contextlib.contextmanager
def _network(options: argparse.Namespace) -> Iterator["Dds | None"]:
    """DDS for robots that speak ROS 2, if requested."""
    if not options.dds:
        yield None
        return
    from iveg.cli.robot import load_config, network_of

    config, _ = load_config(options, os.environ)
    network = network_of(config, os.environ, "iveg emulator --dds")
    from iveg.adapters.dds import Dds

    with Dds(network) as dds:
        yield dds


async def replay(options: argparse.Namespace, settings: Settings) -> None:
    """Recorded logs of real robots, replayed as robots."""
    from iveg.adapters.bags import BagTopics
    from iveg.emulator.replay import run_replay

    fleet = load_fleet(settings.fleet, settings.robots)
    await _refuse_replay(options, settings, fleet)
    with TemporaryDirectory(prefix="iveg-replay-") as directory:
        await run_replay(
            options.files,
            options.robot,
            address=broker_of(settings),
            apikey=settings.apikey,
            speed=options.speed,
            loop=options.loop,
            uplink=settings.uplink,
            slow_s=settings.feedback_slow_s,
            stand_s=settings.feedback_stand_s,
            state_directory=Path(directory),
            fleet=fleet,
            topics=BagTopics(options.odom_topic, options.scan_topic),
            bag_time=options.bag_time,
            frame=options.frame,
            poses=dict(options.pose),
        )


async def _refuse_replay(
    options: argparse.Namespace, settings: Settings, fleet: FleetDescription
) -> None:
    """Refuse a replay that could be taken for a live robot."""
    for name, _ in options.pose:
        if name not in options.robot:
            raise DataFileError("--pose", name, "is none of the robots to be played")
    for name in options.robot:
        if name not in fleet.members:
            known = ", ".join(fleet.ids)
            reason = f"is not in the fleet (IVEG_ROBOTS: {known})"
            raise DataFileError("--robot", name, reason)
        if fleet.of_robot(name).kind == "live":
            reason = f"is a live robot of the fleet; {name}:recording in IVEG_ROBOTS"
            raise DataFileError("--robot", name, f"{reason} makes it a recording")
    if options.force:
        return
    host = broker_of(settings).host
    if host not in LOOPBACK:
        raise DataFileError(
            "IVEG_MQTT_URL", host, "is not on loopback; --force if that is meant"
        )
    orion = OrionClient(
        settings.orion_url, settings.fiware_service, settings.fiware_servicepath
    )
    try:
        for robot_id in options.robot:
            heard = await orion.modified_at(robot_id)
            if heard is not None and clock.now().wall - heard < _LIVE_ROBOT_S:
                raise DataFileError(
                    "--robot", robot_id, "was live in the last 10 s; --force if meant"
                )
    finally:
        await orion.close()


# --- once -------------------------------------------------------------------------


def upgrade_database(settings: Settings, data: Path) -> int:
    """Upgrade the history's database to the newest schema."""
    data.mkdir(parents=True, exist_ok=True)
    upgrade(_database_url(settings, data))
    print("The database is up to date.")
    return 0


def provision_fleet(settings: Settings) -> int:
    """Create or repair the fleet's devices, and print the repairs."""

    async def work() -> None:
        service = settings.fiware_service, settings.fiware_servicepath
        orion = OrionClient(settings.orion_url, *service)
        agent = IotAgentClient(settings.iota_url, *service)
        try:
            done = await provision(
                agent,
                orion,
                robots=load_fleet(settings.fleet, settings.robots).ids,
                apikey=settings.apikey,
                cbroker_url=settings.iota_cb_url or settings.orion_url,
            )
        finally:
            await orion.close()
            await agent.close()
        said = [*done.mended, *done.problems]
        print("\n".join(said) or "Everything was as it should be.")

    asyncio.run(work())
    return 0


def _address(url: str, default_port: int) -> tuple[str, int]:
    parts = urlsplit(url)
    return parts.hostname or "127.0.0.1", parts.port or default_port
