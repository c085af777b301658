"""``iveg doctor``: examines every hop of the chain by using it once.

A probe of its own is made, measured, commanded and removed again; no robot's device,
entity or topic is touched, so it may run while robots drive.
"""

import asyncio
import contextlib
import secrets
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from ipaddress import ip_address
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import orjson

from iveg.adapters import clock
from iveg.adapters.doctor import Ear, ProbeDevice, check_database, probe_device
from iveg.adapters.history.engine import describe, sqlite_url
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.orion import FiwareHttp, OrionClient
from iveg.app import broker_of, notify_url_of
from iveg.cli.diagnosis import Finding, Hop, Stack, exit_code, judge, missing, table
from iveg.cli.probe import Probe
from iveg.cli.running import run_until_told
from iveg.domain.errors import HopError, IvegError
from iveg.embedded.http_server import Request, Response, http_server
from iveg.ngsi import names
from iveg.settings import Settings

PATIENCE_S = 5.0
_LOOK_EVERY_S = 0.05
_ANYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104 - read, not bound


def run_doctor(settings: Settings, data: Path) -> int:
    """Examine, print the table, tidy up; returns the exit code."""
    examination = Examination(settings, data)
    run_until_told(examination.run())
    rows = judge(examination.findings, examination.stack)
    print(table(rows))
    for sentence in examination.left_behind:
        print(sentence)
    return exit_code(rows)


class Examination:
    """One visit: every hop tried once, everything removed afterwards.

    Args:
        settings: The addresses of the parts.
        data: Where the history is unless the settings say otherwise.
        patience_s: How long each hop may take (s).

    Attributes:
        findings: What was found so far.
    """

    def __init__(
        self, settings: Settings, data: Path, patience_s: float = PATIENCE_S
    ) -> None:
        service = settings.fiware_service, settings.fiware_servicepath
        self._settings = settings
        self._patience_s = patience_s
        self._address = broker_of(settings)
        self._database = settings.database_url or sqlite_url(data / "iveg.sqlite")
        self._orion = OrionClient(settings.orion_url, *service)
        self._agent = IotAgentClient(settings.iota_url, *service)
        self._page = FiwareHttp("page", _page_url(settings), *service)
        self._probe = Probe(self._orion, self._agent, settings.apikey)
        self._device: ProbeDevice | None = None
        self._listening_at = ""
        self._mark = ""
        self._began = 0.0
        self.findings: dict[Hop, Finding] = {}

    @property
    def stack(self) -> Stack:
        """What was examined, for sentences."""
        address, settings = self._address, self._settings
        return Stack(
            broker=f"{address.host}:{address.port}",
            user=address.user or "",
            orion=settings.orion_url,
            agent=settings.iota_url,
            listener=self._listening_at,
            database=describe(self._database),
            page=_page_url(settings),
            topics=self._probe.topic(""),
        )

    @property
    def left_behind(self) -> list[str]:
        """What could not be removed, as sentences."""
        return self._probe.left_behind

    async def run(self) -> None:
        """Try every hop; tidy up also when cancelled."""
        async with AsyncExitStack() as stack:
            for client in (self._orion, self._agent, self._page):
                stack.push_async_callback(client.close)
            stack.push_async_callback(self._probe.remove)
            await self._try(Hop.BROKER, lambda: self._connect(stack))
            await self._try(Hop.ORION, self._orion.version)
            await self._try(Hop.AGENT, self._agent.version)
            await self._try(Hop.DEVICE, self._make_device)
            await self._try(Hop.MEASURE, self._measure)
            await self._try(Hop.NOTIFICATION, self._be_notified)
            await self._try(Hop.COMMAND, self._command)
            await self._try(Hop.ANSWER, self._answer)
            await self._try(Hop.DIRECT, self._command_straight)
            await self._try(Hop.DATABASE, self._look_at_database)
            await self._try(Hop.PAGE, self._look_at_page)

    async def _try(self, hop: Hop, step: Callable[[], Awaitable[object]]) -> None:
        if missing(hop, self.findings):
            return
        trouble = None
        self._began = clock.now().mono
        try:
            await step()
        except TimeoutError:
            trouble = ""
        except HopError as error:
            trouble = error.detail
        except (IvegError, OSError) as error:
            trouble = str(error)
        took_s = clock.now().mono - self._began
        self.findings[hop] = Finding(hop, took_s, trouble)

    # --- hops ---------------------------------------------------------------------

    async def _connect(self, stack: AsyncExitStack) -> None:
        echo, command = self._probe.topic("echo"), self._probe.topic(names.COMMAND)
        connection = probe_device(self._address, (echo, command), self._patience_s)
        self._device = device = await stack.enter_async_context(connection)
        mark = device.ear.mark()
        await device.publish(echo, mark.encode(), self._patience_s)
        try:
            await device.ear.heard(mark, self._patience_s)
        except TimeoutError as error:
            raise HopError("mqtt", "gives no echo of what we publish") from error

    async def _make_device(self) -> None:
        settings = self._settings
        await self._probe.make_device(settings.iota_cb_url or settings.orion_url)

    async def _measure(self) -> None:
        mark = secrets.token_hex(8)
        await self._publish("attrs", {"probe": {"mark": mark}})
        await self._seen("probe", mark)

    async def _be_notified(self) -> None:
        """Past the agent, so that only Orion and the way from it are on trial."""
        ear = Ear()

        async def take(request: Request) -> Response:
            ear.hear(request.body)
            return Response(204)

        host = _notify_host(self._settings)
        async with http_server(take, _bind_to(host), 0) as port:
            self._listening_at = f"http://{_in_url(host)}:{port}/"
            subscription = await self._probe.subscribe(self._listening_at)
            mark = ear.mark()
            # What was done so far is preparation; the hop begins here.
            self._began = clock.now().mono
            await self._probe.change(mark)
            try:
                await ear.heard(mark, self._patience_s)
            except TimeoutError as error:
                reason = await self._probe.why_not_notified(subscription)
                raise HopError("orion", reason) from error

    async def _command(self) -> None:
        device = self._connected
        self._mark = device.ear.mark()
        await self._probe.command(self._mark)
        await device.ear.heard(self._mark, self._patience_s)

    async def _answer(self) -> None:
        await self._publish("cmdexe", {names.COMMAND: {"probe": self._mark}})
        await self._seen(names.COMMAND_INFO, self._mark)

    async def _command_straight(self) -> None:
        mark = self._connected.ear.mark()
        await self._publish(names.COMMAND, {names.COMMAND: {"probe": mark}})
        await self._connected.ear.heard(mark, self._patience_s)

    async def _look_at_database(self) -> None:
        await asyncio.to_thread(check_database, self._database)

    async def _look_at_page(self) -> None:
        await self._page.ask("GET", "/healthz", timeout_s=self._patience_s)

    # --- what hops do -------------------------------------------------------------

    @property
    def _connected(self) -> ProbeDevice:
        if self._device is None:
            raise HopError("mqtt", "not connected")
        return self._device

    async def _publish(self, last: str, payload: dict[str, Any]) -> None:
        body = orjson.dumps(payload)
        topic = self._probe.topic(last)
        await self._connected.publish(topic, body, self._patience_s)

    async def _seen(self, attribute: str, mark: str) -> None:
        """Until Orion has the mark in an attribute of the probe."""
        async with asyncio.timeout(self._patience_s):
            # Orion is asked: whether it calls is another hop's question.
            while not await self._probe.holds(attribute, mark):  # noqa: ASYNC110
                await asyncio.sleep(_LOOK_EVERY_S)


def _notify_host(settings: Settings) -> str:
    """The host that Orion is told to post to by an iVeg with these settings."""
    url = settings.notify_url or notify_url_of(settings)
    return urlsplit(url).hostname or settings.host


def _bind_to(host: str) -> str:
    """Loopback stays loopback; any other name may be a container's or a router's."""
    with contextlib.suppress(ValueError):
        address = ip_address(host)
        if address.is_loopback:
            return host
        return "::" if address.version == 6 else "0.0.0.0"  # noqa: S104
    return "127.0.0.1" if host == "localhost" else "0.0.0.0"  # noqa: S104


def _page_url(settings: Settings) -> str:
    host = _ANYWHERE.get(settings.host, settings.host)
    return f"http://{_in_url(host)}:{settings.port}"


def _in_url(host: str) -> str:
    return f"[{host}]" if ":" in host else host
