"""Notifications that are answered at once: like all others, and in their order."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from iveg.web.security.headers import MAX_BODY
from tests.builders import notification
from tests.unit.web.desk import SECRET, TENANT, WebDesk

GIVEN = {"X-Iveg-Notify-Token": SECRET, **TENANT}


class Wire:
    """A connection to a server, byte for byte."""

    def __init__(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self._reader, self._writer = reader, writer

    def post(
        self, body: bytes, path: str = "/ngsi/notifications", **more: str
    ) -> "Wire":
        words = {"Host": "iveg", "Content-Length": str(len(body)), **GIVEN, **more}
        head = [f"POST {path} HTTP/1.1", *(f"{k}: {v}" for k, v in words.items() if v)]
        self._writer.write("\r\n".join([*head, "", ""]).encode() + body)
        return self

    async def status(self) -> int:
        """Of the next answer, whose body is read away."""
        head = (await self._reader.readuntil(b"\r\n\r\n")).decode().lower()
        _, found, rest = head.partition("content-length: ")
        if found:
            await self._reader.readexactly(int(rest.split("\r\n")[0]))
        return int(head.split()[1])


@asynccontextmanager
async def wired(desk: WebDesk) -> AsyncIterator[Wire]:
    async with desk.serving() as place, asyncio.timeout(10):
        host, _, port = place.partition(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        yield Wire(reader, writer)
        writer.close()


def ours(**parts: object) -> bytes:
    return notification(subscription_id="ours", **parts)  # type: ignore[arg-type]


async def test_a_plain_notification_is_taken_without_the_application() -> None:
    desk = WebDesk()
    desk.app.router.routes.clear()
    async with wired(desk) as wire:
        assert await wire.post(ours()).status() == 204
    assert desk.ingest.waiting == 1
    assert desk.heard == [desk.clock()]


async def test_those_that_come_together_are_answered_in_their_order() -> None:
    desk = WebDesk()
    async with wired(desk) as wire:
        wire.post(ours()).post(b"no json").post(ours(), "/nowhere").post(ours())
        assert [await wire.status() for _ in range(4)] == [204, 400, 404, 204]
    assert desk.ingest.waiting == 2


@pytest.mark.parametrize(
    ("more", "status"),
    [
        ({"X-Iveg-Notify-Token": "ab" * 31 + "cd"}, 401),
        ({"X-Iveg-Notify-Token": ""}, 401),
        ({"Content-Length": str(MAX_BODY + 1)}, 413),
        ({"Fiware-Service": "other"}, 204),
    ],
    ids=["wrong secret", "no secret", "too long", "another tenant"],
)
async def test_what_is_refused_elsewhere_is_refused_here(
    more: dict[str, str], status: int
) -> None:
    desk = WebDesk()
    async with wired(desk) as wire:
        assert await wire.post(ours(), **more).status() == status
    assert desk.ingest.waiting == 0
    assert desk.heard == []


async def test_a_body_of_unknown_length_goes_the_way_of_all_requests() -> None:
    desk = WebDesk()
    whole = ours()
    chunked = b"%x\r\n%b\r\n0\r\n\r\n" % (len(whole), whole)
    async with wired(desk) as wire:
        wire.post(chunked, **{"Content-Length": "", "Transfer-Encoding": "chunked"})
        assert await wire.status() == 204
        assert await wire.post(ours()).status() == 204
    assert desk.ingest.waiting == 2
