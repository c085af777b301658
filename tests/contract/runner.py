"""Plays contract cases against a FIWARE, embedded or real.

A case is JSON: ``about`` says what it proves, ``steps`` are played in order:

- ``{"orion": "GET /v2/entities", …}`` and ``{"iota": …}`` send a request; ``json``,
  ``text`` and ``headers`` are what is sent, ``status``, ``gives`` (JSON) and ``shows``
  (headers) what must come back.  ``"soon": true`` asks again until
  it does.  ``"save": {"sub": "/v2/subscriptions/(.+)"}`` keeps a part of ``Location``.
- ``{"publish": topic, "json" | "text" | "hex": …, "qos": n}`` sends over MQTT.
- ``{"command": topic, "json": …, "qos": n}`` waits for what a device would hear.
- ``{"heard": path, "json": …, "shows": {…}}`` waits for a notification;
  ``{"heard": path, "any_order": [body, …]}`` for several.
- ``{"quiet": true}``: no notification was left over.
- ``{"listener": {"status": 500}}``: how the receiver answers from now on.

In what is expected ``"*"`` is anything, ``"~…"`` a pattern, and ``"…": "…"`` in an
object allows more than is named.  ``${name}`` is filled in everywhere.
"""

import asyncio
import re
import secrets
import ssl
import time
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import aiomqtt
import httpx
import orjson

from tests.faulty_fiware import faulty_fiware
from tests.http_servers import Request, Response, http_server
from tests.patience import PATIENCE_S

SETTLED_S = 0.15


@dataclass(frozen=True, slots=True)
class Stack:
    """Where a FIWARE is."""

    orion: str
    iota: str
    mqtt: tuple[str, int]
    listener_host: str = "127.0.0.1"


@asynccontextmanager
async def embedded_stack() -> AsyncIterator[Stack]:
    """The embedded pair on free ports."""
    async with faulty_fiware() as up:
        yield Stack(up.orion_url, up.iota_url, ("127.0.0.1", up.mqtt_port))


@dataclass(slots=True)
class Listener:
    """A receiver of notifications that remembers them."""

    heard: asyncio.Queue[Request] = field(default_factory=asyncio.Queue)
    status: int = 204

    async def handle(self, request: Request) -> Response:
        """Take one notification."""
        self.heard.put_nowait(request)
        return Response(self.status)


class Player:
    """Plays the steps of one case."""

    def __init__(
        self, stack: Stack, http: httpx.AsyncClient, mqtt: aiomqtt.Client, port: int
    ) -> None:
        self.listener = Listener()
        self._stack = stack
        self._http = http
        self._mqtt = mqtt
        tag = secrets.token_hex(4)
        self.known = {
            "service": f"t{tag}",
            "key": f"k{tag}",
            "listener": f"http://{stack.listener_host}:{port}",
            "cbroker": stack.orion,
        }
        self._commands: list[aiomqtt.Message] = []

    async def play(self, step: Mapping[str, Any]) -> None:
        """Play one step."""
        step = self._filled(step)
        for verb in ("orion", "iota", "publish", "command", "heard", "quiet"):
            if verb in step:
                await getattr(self, f"_{verb}")(step)
                return
        self.listener.status = step["listener"]["status"]

    def _filled(self, value: Any) -> Any:
        text = orjson.dumps(value).decode()
        for name, known in self.known.items():
            text = text.replace("${" + name + "}", known)
        return orjson.loads(text)

    async def _orion(self, step: Mapping[str, Any]) -> None:
        await self._request(self._stack.orion, step["orion"], step)

    async def _iota(self, step: Mapping[str, Any]) -> None:
        await self._request(self._stack.iota, step["iota"], step)

    async def _request(self, base: str, line: str, step: Mapping[str, Any]) -> None:
        method, _, path = line.partition(" ")
        deadline = time.monotonic() + PATIENCE_S
        while True:
            response = await self._http.request(
                method,
                base + path,
                content=_content(step),
                headers=self._headers(step),
            )
            wrong = _wrong_response(step, response)
            if not wrong or not step.get("soon") or time.monotonic() > deadline:
                break
            await asyncio.sleep(0.02)
        assert not wrong, f"{line}: {wrong}"
        for name, pattern in step.get("save", {}).items():
            found = re.search(pattern, response.headers["Location"])
            assert found is not None
            self.known[name] = found[1]

    def _headers(self, step: Mapping[str, Any]) -> dict[str, str]:
        headers = {
            "Fiware-Service": self.known["service"],
            "Fiware-ServicePath": "/greenhouse",
        }
        if "json" in step:
            headers["Content-Type"] = "application/json"
        headers |= step.get("headers", {})
        return {name: value for name, value in headers.items() if value}

    async def _publish(self, step: Mapping[str, Any]) -> None:
        await self._mqtt.publish(
            step["publish"], _content(step) or b"", qos=step.get("qos", 0)
        )

    async def _command(self, step: Mapping[str, Any]) -> None:
        async with asyncio.timeout(PATIENCE_S):
            async for message in self._mqtt.messages:
                if str(message.topic).endswith("/cmd"):
                    break
        assert str(message.topic) == step["command"]
        assert isinstance(message.payload, bytes)
        assert orjson.loads(message.payload) == step["json"]
        assert message.qos == step.get("qos", message.qos)

    async def _heard(self, step: Mapping[str, Any]) -> None:
        if "any_order" in step:
            await self._heard_in_any_order(step["heard"], step["any_order"])
            return
        request = await self._notification(step["heard"])
        for name, wanted in step.get("shows", {}).items():
            assert not _differs(wanted, request.headers.get(name.lower()), name)
        wrong = _differs(step["json"], orjson.loads(request.body))
        assert not wrong, wrong

    async def _heard_in_any_order(self, path: str, wanted: list[Any]) -> None:
        # Orion sends each notification on a thread of its own.
        bodies = [orjson.loads((await self._notification(path)).body) for _ in wanted]
        for one in wanted:
            fitting = [body for body in bodies if not _differs(one, body)]
            assert fitting, f"{one} is not among {bodies}"
            bodies.remove(fitting[0])

    async def _notification(self, path: str) -> Request:
        async with asyncio.timeout(PATIENCE_S):
            request = await self.listener.heard.get()
        assert request.path == path
        return request

    async def _quiet(self, _: Mapping[str, Any]) -> None:
        # A silence can only be waited for; the pause is generous against 1 ms.
        await asyncio.sleep(SETTLED_S)
        assert self.listener.heard.empty(), self.listener.heard.get_nowait()


@cache
def _trusted() -> ssl.SSLContext:
    """Read once for all cases; a real FIWARE may be behind TLS."""
    return httpx.create_ssl_context()


@asynccontextmanager
async def playing(stack: Stack) -> AsyncIterator[Player]:
    """A player with its listener and connections, ready."""
    players: list[Player] = []

    async def handle(request: Request) -> Response:
        return await players[0].listener.handle(request)

    async with (
        http_server(handle, stack.listener_host, 0) as port,
        httpx.AsyncClient(timeout=PATIENCE_S, verify=_trusted()) as http,
        aiomqtt.Client(*stack.mqtt) as mqtt,
    ):
        players.append(Player(stack, http, mqtt, port))
        await mqtt.subscribe(f"/{players[0].known['key']}/+/cmd", qos=1)
        yield players[0]


def _content(step: Mapping[str, Any]) -> bytes | None:
    if "json" in step:
        return orjson.dumps(step["json"])
    if "text" in step:
        return str(step["text"]).encode()
    if "long" in step:
        return orjson.dumps(_stretched(step["long"]))
    return bytes.fromhex(step["hex"]) if "hex" in step else None


def _stretched(value: Any) -> Any:
    """``{"$x": n}`` is n letters, so that a case stays short."""
    if isinstance(value, dict) and "$x" in value:
        return "x" * int(value["$x"])
    if isinstance(value, dict):
        return {name: _stretched(part) for name, part in value.items()}
    return value


def _wrong_response(step: Mapping[str, Any], response: httpx.Response) -> str:
    if "status" in step and response.status_code != step["status"]:
        return f"status {response.status_code}, not {step['status']}: {response.text}"
    for name, wanted in step.get("shows", {}).items():
        if wrong := _differs(wanted, response.headers.get(name), name):
            return wrong
    if "gives" in step:
        return _differs(step["gives"], orjson.loads(response.content))
    return ""


def _differs(wanted: Any, there: Any, place: str = "body") -> str:
    """Where what is there differs from what is wanted; empty if nowhere."""
    if wanted == "*":
        return ""
    if isinstance(wanted, str) and wanted.startswith("~"):
        found = isinstance(there, str) and re.search(wanted[1:], there)
        return "" if found else f"{place} is {there!r}, not {wanted!r}"
    if isinstance(wanted, dict) and isinstance(there, dict):
        return _differs_in(wanted, there, place)
    if isinstance(wanted, list) and isinstance(there, list):
        if len(wanted) != len(there):
            return f"{place} has {len(there)} parts, not {len(wanted)}: {there}"
        pairs = enumerate(zip(wanted, there, strict=True))
        return next(
            (
                wrong
                for i, (w, t) in pairs
                if (wrong := _differs(w, t, f"{place}[{i}]"))
            ),
            "",
        )
    same = wanted == there and type(wanted) is type(there)
    return "" if same else f"{place} is {there!r}, not {wanted!r}"


def _differs_in(wanted: dict[str, Any], there: dict[str, Any], place: str) -> str:
    named = {name: one for name, one in wanted.items() if name != "…"}
    more = there.keys() - named.keys()
    if more and "…" not in wanted:
        return f"{place} also has {sorted(more)}"
    for name, one in named.items():
        if name not in there:
            return f"{place} has no {name}: {there}"
        if wrong := _differs(one, there[name], f"{place}.{name}"):
            return wrong
    return ""
