import asyncio
import contextlib
import gc
import logging
from contextlib import AsyncExitStack
from urllib.parse import urlsplit

import aiomqtt
import httpx
import pytest

from iveg.domain.errors import SettingsError
from iveg.lab.embedded.server import embedded_fiware

LOOPBACK = ("127.0.0.1", 0)
ELSEWHERE = ("0.0.0.0", 0)  # noqa: S104 - refused, which is the point
HEADERS = {"Fiware-Service": "agroconnect", "Fiware-ServicePath": "/greenhouse"}


@pytest.mark.parametrize(
    ("place", "setting"),
    [(0, "IVEG_MQTT_URL"), (1, "IVEG_ORION_URL"), (2, "IVEG_IOTA_URL")],
)
async def test_an_address_that_others_can_reach_is_refused(
    place: int, setting: str
) -> None:
    addresses = [LOOPBACK] * 3
    addresses[place] = ELSEWHERE
    with pytest.raises(SettingsError, match=f"{setting}='0.0.0.0'"):
        async with embedded_fiware(*addresses):
            pass


@pytest.mark.parametrize("taken", [0, 1, 2])
async def test_a_taken_port_is_an_os_error_and_leaves_nothing(
    taken: int, caplog: pytest.LogCaptureFixture
) -> None:
    server = await asyncio.start_server(lambda *_: None, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    addresses = [LOOPBACK] * 3
    addresses[taken] = ("127.0.0.1", port)
    with pytest.raises(OSError, match=r"[Aa]ddress"):
        async with embedded_fiware(*addresses):
            pass
    server.close()
    assert not [one for one in caplog.records if one.levelno >= logging.WARNING]


async def test_closing_under_clients_leaves_no_task_and_no_warning(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with AsyncExitStack() as clients:
        async with embedded_fiware() as up:
            http = await clients.enter_async_context(httpx.AsyncClient(headers=HEADERS))
            mqtt = aiomqtt.Client("127.0.0.1", up.mqtt_port)
            await mqtt.__aenter__()
            await mqtt.subscribe("#")
            for number in range(50):
                await mqtt.publish("/iveg/AGI/attrs", b'{"n":%d}' % number)
            await http.get(up.orion_url + "/v2/entities")
            orion = urlsplit(up.orion_url)
            _, half = await asyncio.open_connection(orion.hostname, orion.port)
            half.write(b"POST /v2/entities HTTP/1.1\r\nContent-Le")
            await half.drain()
        with pytest.raises(aiomqtt.MqttError):
            async for _ in mqtt.messages:
                pass
        with contextlib.suppress(aiomqtt.MqttError):
            await mqtt.__aexit__(None, None, None)
        half.close()
    with contextlib.suppress(ConnectionError):
        await half.wait_closed()
    gc.collect()
    left = [task.get_name() for task in asyncio.all_tasks()]
    assert len(left) == 1, left
    assert not [one for one in caplog.records if one.levelno >= logging.WARNING]


async def ended(reader: asyncio.StreamReader) -> bytes:
    """What a connection says until the server closes it."""
    async with asyncio.timeout(10):
        try:
            return await reader.read()
        except ConnectionResetError:
            return b""


@pytest.mark.parametrize(
    "head",
    [b"GET /" + b"a" * 50_000, b"GET / HTTP/1.1\r\nX: " + b"a" * 50_000],
    ids=["address", "header"],
)
async def test_an_endless_head_is_refused(head: bytes) -> None:
    async with embedded_fiware() as up:
        orion = urlsplit(up.orion_url)
        reader, writer = await asyncio.open_connection(orion.hostname, orion.port)
        writer.write(head)
        said = await ended(reader)
        writer.close()
    assert said.startswith(b"HTTP/1.1 4") or not said


async def test_an_admitted_client_that_announces_megabytes_is_ended() -> None:
    async with embedded_fiware() as up:
        reader, writer = await asyncio.open_connection("127.0.0.1", up.mqtt_port)
        writer.write(b"\x10\x10\x00\x04MQTT\x04\x02\x00\x00\x00\x04long")
        await reader.readexactly(4)
        writer.write(b"\x30\xff\xff\xff\x7f\x00\x01x")
        assert await ended(reader) == b""
        writer.close()
