"""``iveg doctor``: examines every hop of the chain by using it once.

A probe device of its own is made, measured, commanded and removed again; no robot's
device, entity or topic is touched, so it may run while robots drive.
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
from iveg.adapters.iot_agent import RESOURCE, IotAgentClient
from iveg.adapters.orion import FiwareHttp, OrionClient
from iveg.app import broker_of, notify_url_of
from iveg.cli.diagnosis import (
    Finding,
    Hop,
    Stack,
    exit_code,
    judge,
    missing,
    table,
)
from iveg.cli.running import run_until_told
from iveg.domain.errors import HopError, IvegError
from iveg.embedded.http_server import Request, Response, http_server
from iveg.ngsi import names
from iveg.settings import Settings

PROBE_ID, PROBE_TYPE = "iveg-doctor", names.CANARY_TYPE
DESCRIPTION = "iveg doctor"
"""Of the subscription.  Not ``iVeg: …``: a running iVeg removes such strangers."""
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
        left_behind: What could not be removed, as sentences.
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
        self._listener = Ear()
        self._notify_host = _notify_host(settings)
        self._listening_at = ""
        self._device: ProbeDevice | None = None
        self._mark = ""
        self._began = 0.0
        self._made_device = self._made_group = self._touched_orion = False
        self.findings: dict[Hop, Finding] = {}
        self.left_behind: list[str] = []

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
            topics=_topic(settings.apikey, ""),
        )

    async def run(self) -> None:
        """Try every hop; tidy up also when cancelled."""
        async with AsyncExitStack() as stack:
            for client in (self._orion, self._agent, self._page):
                stack.push_async_callback(client.close)
            stack.push_async_callback(self._tidy)
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
        except IvegError as error:
            trouble = str(error)
        took_s = clock.now().mono - self._began
        self.findings[hop] = Finding(hop, took_s, trouble)

    # --- hops ---------------------------------------------------------------------

    async def _connect(self, stack: AsyncExitStack) -> None:
        echo = _topic(self._settings.apikey, "echo")
        command = names.command_topic(self._settings.apikey, PROBE_ID)
        connection = probe_device(self._address, (echo, command), self._patience_s)
        self._device = device = await stack.enter_async_context(connection)
        mark = device.ear.mark()
        await device.publish(echo, mark.encode(), self._patience_s)
        try:
            await device.ear.heard(mark, self._patience_s)
        except TimeoutError as error:
            raise HopError("mqtt", "gives no echo of what we publish") from error

    async def _make_device(self) -> None:
        """Make the device, and its group where iVeg has never run."""
        settings = self._settings
        self._made_device = self._touched_orion = True
        orion = settings.iota_cb_url or settings.orion_url
        group = _group(settings.apikey, orion)
        known = [one.get("apikey") for one in await self._agent.read_groups()]
        if settings.apikey not in known:
            self._made_group = True
            await self._agent.create_group(group)
        await self._agent.delete_device(PROBE_ID)
        if not await self._agent.create_device(_probe(settings.apikey)):
            raise HopError("iot_agent", "says that there is such a device already")

    async def _measure(self) -> None:
        mark = secrets.token_hex(8)
        await self._publish("attrs", {"probe": {"mark": mark}})
        await self._seen("probe", mark)

    async def _be_notified(self) -> None:
        """Change the entity at Orion itself, so that only this hop is on trial."""
        self._touched_orion = True
        async with http_server(self._take, _bind_to(self._notify_host), 0) as port:
            shown = f"[{self._notify_host}]" if ":" in self._notify_host else None
            self._listening_at = f"http://{shown or self._notify_host}:{port}/"
            made = await self._orion.create_subscription(
                _subscription(self._listening_at)
            )
            mark = self._listener.mark()
            self._began = clock.now().mono
            await self._upsert({"type": "object", "value": {"mark": mark}})
            try:
                await self._listener.heard(mark, self._patience_s)
            except TimeoutError as error:
                raise HopError("orion", await self._failure_of(made)) from error

    async def _take(self, request: Request) -> Response:
        self._listener.hear(request.body)
        return Response(204)

    async def _command(self) -> None:
        """``cmd`` alone, with its type: what else Orion does, it does silently."""
        device = self._connected
        self._mark = device.ear.mark()
        command = {names.COMMAND: {"type": "command", "value": {"probe": self._mark}}}
        await self._orion.http.ask(
            "PATCH",
            f"/v2/entities/{PROBE_ID}/attrs",
            query={"type": PROBE_TYPE},
            body=command,
        )
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
        topic = _topic(self._settings.apikey, last)
        await self._connected.publish(topic, orjson.dumps(payload), self._patience_s)

    async def _seen(self, attribute: str, mark: str) -> None:
        """Until Orion has the mark in an attribute of the probe."""
        query = {"type": PROBE_TYPE, "attrs": attribute, "options": "skipForwarding"}
        async with asyncio.timeout(self._patience_s):
            while True:
                response = await self._orion.http.ask(
                    "GET", f"/v2/entities/{PROBE_ID}", query=query, also=(404,)
                )
                if mark in response.text:
                    return
                await asyncio.sleep(_LOOK_EVERY_S)

    async def _upsert(self, attribute: dict[str, Any]) -> None:
        entity = {"id": PROBE_ID, "type": PROBE_TYPE, "probe": attribute}
        await self._orion.http.ask(
            "POST", "/v2/entities", query={"options": "upsert"}, body=entity
        )

    async def _failure_of(self, subscription_id: str) -> str:
        """Why Orion says that a notification did not arrive."""
        for one in await self._orion.read_subscriptions():
            if one.get("id") == subscription_id:
                told = one.get("notification", {})
                if told.get("lastFailureReason"):
                    return str(told["lastFailureReason"])
                if told.get("lastSuccess"):
                    return "Orion believes that it did; somebody else answers there"
        return f"nothing came in {self._patience_s:g} s and Orion gives no reason"

    # --- afterwards ---------------------------------------------------------------

    async def _tidy(self) -> None:
        """Remove all that was made, the device first: it may still write."""
        if self._made_device:
            await self._remove("device", self._agent.delete_device(PROBE_ID))
        if self._made_group:
            await self._remove("group", self._delete_group())
        if self._touched_orion:
            await self._remove("subscription", self._delete_subscriptions())
            await self._remove("registration", self._delete_registrations())
            await self._remove("entity", self._delete_entity())

    async def _remove(self, what: str, removing: Awaitable[object]) -> None:
        try:
            await removing
        except HopError as error:
            self.left_behind.append(
                f"The {what} of {PROBE_ID} may be left behind ({error}); the next "
                "`iveg doctor` removes it."
            )

    async def _delete_group(self) -> None:
        query = {"resource": RESOURCE, "apikey": self._settings.apikey}
        await self._agent.http.ask("DELETE", "/iot/services", query=query, also=(404,))

    async def _delete_subscriptions(self) -> None:
        for one in await self._orion.read_subscriptions():
            if one.get("description") == DESCRIPTION:
                await self._orion.delete_subscription(one["id"])

    async def _delete_registrations(self) -> None:
        for one in await self._orion.read_registrations():
            entities = one.get("dataProvided", {}).get("entities", [])
            if any(entity.get("id") == PROBE_ID for entity in entities):
                await self._orion.delete_registration(one["id"])

    async def _delete_entity(self) -> None:
        path, query = f"/v2/entities/{PROBE_ID}", {"type": PROBE_TYPE}
        await self._orion.http.ask("DELETE", path, query=query, also=(404,))


def _topic(apikey: str, last: str) -> str:
    return f"/{apikey}/{PROBE_ID}/{last}"


def _group(apikey: str, orion_url: str) -> dict[str, Any]:
    return {
        "apikey": apikey,
        "resource": RESOURCE,
        "cbroker": orion_url,
        "entity_type": names.ROBOT_TYPE,
        "attributes": [],
        "lazy": [],
        "commands": [],
        "static_attributes": [],
    }


def _probe(apikey: str) -> dict[str, Any]:
    return {
        "device_id": PROBE_ID,
        "entity_name": PROBE_ID,
        "entity_type": PROBE_TYPE,
        "apikey": apikey,
        "protocol": "JSON",
        "transport": "MQTT",
        "attributes": [{"object_id": "probe", "name": "probe", "type": "object"}],
        "commands": [{"name": names.COMMAND, "type": "command"}],
    }


def _subscription(url: str) -> dict[str, Any]:
    return {
        "description": DESCRIPTION,
        "subject": {
            "entities": [{"id": PROBE_ID, "type": PROBE_TYPE}],
            "condition": {"attrs": ["probe"]},
        },
        "notification": {"http": {"url": url}, "attrs": ["probe"]},
    }


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
    shown = f"[{host}]" if ":" in host else host
    return f"http://{shown}:{settings.port}"
