"""A plain relay, to stand beside iVeg: every MQTT message to every browser, at once.

No FIWARE, no rule, no history, no credit: what somebody writes on a first afternoon,
and so the least that pixels can cost.  Started by ``benchmarks.glass``::

    python -m uvicorn benchmarks.relay:app

with ``RELAY_MQTT_PORT`` and ``RELAY_APIKEY`` in the environment.
"""

import asyncio
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import aiomqtt
import orjson
from fastapi import FastAPI, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse

_PAGE = Path(__file__).with_name("relay.html")
_pages: set[WebSocket] = set()


@asynccontextmanager
async def _running(_: FastAPI) -> AsyncIterator[None]:
    relaying = asyncio.create_task(_relay())
    yield
    relaying.cancel()


async def _relay() -> None:
    port, apikey = int(os.environ["RELAY_MQTT_PORT"]), os.environ["RELAY_APIKEY"]
    async with aiomqtt.Client("127.0.0.1", port) as broker:
        await broker.subscribe(f"/{apikey}/+/attrs")
        async for message in broker.messages:
            said = orjson.loads(bytes(message.payload))
            told = {"topic": message.topic.value, "data": said}
            for page in list(_pages):
                with suppress(RuntimeError, WebSocketDisconnect):
                    await page.send_json(told)


app = FastAPI(lifespan=_running)


@app.get("/")
async def page() -> FileResponse:
    """A canvas."""
    return FileResponse(_PAGE)


@app.websocket("/live")
async def live(websocket: WebSocket) -> None:
    """One page looks."""
    await websocket.accept()
    _pages.add(websocket)
    async for _ in websocket.iter_text():
        pass  # Whatever it says, it is sent everything.
    _pages.discard(websocket)
