"""Pages on other machines: they read, paint at 60 Hz and say so, and draw nothing here.

Five browsers that draw on one machine measure that machine's drawing; what more pages
cost a server, and the page that is looked at, is measured with these beside it::

    python -m benchmarks.readers --link http://127.0.0.1:8000/signin#token=… --pages 4

A reader asks for ``iveg.2``; a server without it, such as the relay, tells all it has.
"""

import argparse
import asyncio
import time
from collections.abc import Callable
from http.client import HTTPConnection
from typing import Final
from urllib.parse import parse_qs, urlsplit

import orjson
import uvloop
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

FRAME_S: Final = 1 / 60
DRAWS_S: Final = 0.005
"""From the beginning of a frame of its screen until the page has drawn."""
LEAD_S: Final = 0.005
"""Before the next frame of the screen, to be in it."""


async def look(link: str, page_on: "Callable[[ClientConnection], Reader]") -> None:
    """One page, until it is closed."""
    address, cookie = sign_in(link)
    headers = {"Cookie": cookie} if cookie else {}
    async with connect(
        f"ws://{address}/live",
        additional_headers=headers,
        origin=Origin(f"http://{address}"),
        subprotocols=[Subprotocol("iveg.2")],
        compression=None,
        max_size=None,
    ) as line:
        page = page_on(line)
        painting = asyncio.create_task(page.paint())
        try:
            async for message in line:
                page.take(message)
        finally:
            painting.cancel()


class Reader:
    """A page that takes its time to paint, and paints nothing."""

    def __init__(self, line: ClientConnection) -> None:
        self._line = line
        self._taken = 0
        self._pinged = 0.0

    def take(self, message: str | bytes) -> None:
        """Note the number of a frame of telemetry."""
        if isinstance(message, bytes):
            self._taken = _number(message)

    async def paint(self) -> None:
        """Say after each frame of the screen what is in it."""
        told, begins_at = 0, time.monotonic()
        while True:
            now = time.monotonic()
            begins_at += FRAME_S * max(1.0, (now - begins_at) // FRAME_S)
            await asyncio.sleep(max(0.0, begins_at - now))
            drawn = self._taken
            await asyncio.sleep(DRAWS_S)
            if drawn > told:
                told = drawn
                wait_s = begins_at + FRAME_S - LEAD_S - time.monotonic()
                said = {"frame": drawn, "wait": max(0.0, wait_s)}
                await self._say("painted", said)
            if begins_at - self._pinged > 1.0:
                self._pinged = begins_at
                await self._say("ping", {"t": begins_at})

    async def _say(self, word: str, more: dict[str, float]) -> None:
        await self._line.send(orjson.dumps({"type": word, **more}).decode())


def _number(message: bytes) -> int:
    """Of a frame, that its head begins with."""
    start = message.index(b":", 4) + 1
    return int(message[start : message.index(b",", start)])


def sign_in(link: str) -> tuple[str, str]:
    """Where the server is, and the cookie that it gives."""
    parts = urlsplit(link)
    token = parse_qs(parts.fragment).get("token")
    if token is None:
        # The relay asks nobody who they are.
        return parts.netloc, ""
    asking = HTTPConnection(parts.netloc, timeout=10)
    asking.request(
        "POST",
        "/signin",
        orjson.dumps({"token": token[0]}),
        {
            "Content-Type": "application/json",
            "Origin": f"http://{parts.netloc}",
            "X-IVEG": "1",
        },
    )
    answer = asking.getresponse()
    cookie = answer.getheader("Set-Cookie") or ""
    asking.close()
    return parts.netloc, cookie.partition(";")[0]


async def _look_all(link: str, pages: int) -> None:
    async with asyncio.TaskGroup() as tasks:
        for _ in range(pages):
            tasks.create_task(look(link, Reader))


def main() -> None:
    """Look as the command line says, until ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--link", required=True)
    parser.add_argument("--pages", type=int, default=4)
    asked = parser.parse_args()
    uvloop.run(_look_all(asked.link, asked.pages))


if __name__ == "__main__":
    main()
