"""The probe device of ``iveg doctor``.

It reports the reason of a failure where a running iVeg tries again.
"""

import asyncio
import contextlib
import secrets
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager

import aiomqtt

from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.mqtt import NODELAY
from iveg.domain.errors import HopError

_REFUSED = 128
"""From this code on, a broker's answer to a subscription is a refusal."""


class TopicListener:
    """Waits for messages by a mark that no other program can know."""

    def __init__(self) -> None:
        self._awaited: dict[bytes, asyncio.Event] = {}

    def mark(self) -> str:
        """A new mark to send; from now on the ear waits for it."""
        mark = secrets.token_hex(8)
        self._awaited[mark.encode()] = asyncio.Event()
        return mark

    def hear(self, payload: bytes) -> None:
        """Take a message."""
        for mark, heard in self._awaited.items():
            if mark in payload:
                heard.set()

    async def heard(self, mark: str, within_s: float) -> None:
        """Wait until a message has carried the mark.

        Raises:
            TimeoutError: none has.
        """
        async with asyncio.timeout(within_s):
            await self._awaited[mark.encode()].wait()


class ProbeDevice:
    """A device at the broker that subscribes to a few topics and may publish."""

    def __init__(self, client: aiomqtt.Client, ear: TopicListener) -> None:
        self._client = client
        self.ear = ear

    async def publish(self, topic: str, payload: bytes, within_s: float) -> None:
        """Publish at QoS 1; return when the broker has it.

        Raises:
            HopError: the connection is gone, or the broker did not confirm.
        """
        try:
            await self._client.publish(topic, payload, qos=1, timeout=within_s)
        except aiomqtt.MqttError as error:
            raise HopError("mqtt", str(error)) from error


@asynccontextmanager
async def probe_device(
    address: BrokerAddress, topics: Sequence[str], within_s: float
) -> AsyncIterator[ProbeDevice]:
    """Stay connected while the block lasts, without reconnecting.

    Args:
        address: The broker.
        topics: What the device hears.
        within_s: How long the broker may take to let us in (s).

    Raises:
        HopError: the broker is away, refuses us or refuses a topic.
    """
    client = aiomqtt.Client(
        address.host,
        address.port,
        username=address.user,
        password=address.password,
        timeout=within_s,
        tls_context=address.context(),
        socket_options=NODELAY,
    )
    device = ProbeDevice(client, TopicListener())
    async with contextlib.AsyncExitStack() as stack:
        try:
            await client.__aenter__()
            stack.push_async_callback(_leave, client)
            for topic in topics:
                await _subscribe(client, topic)
        except (aiomqtt.MqttError, OSError) as error:
            raise HopError("mqtt", str(error) or type(error).__name__) from error
        hearing = asyncio.create_task(_hear(client, device.ear), name="doctor-mqtt")
        stack.push_async_callback(_end, hearing)
        yield device


async def _subscribe(client: aiomqtt.Client, topic: str) -> None:
    granted = await client.subscribe(topic, qos=1)
    for code in granted:
        value = code if isinstance(code, int) else code.value
        if value >= _REFUSED:
            raise HopError("mqtt", f"gives no echo: it refuses to let us hear {topic}")


async def _hear(client: aiomqtt.Client, ear: TopicListener) -> None:
    # A lost connection shows in missing messages; nothing awaits this task.
    with contextlib.suppress(aiomqtt.MqttError):
        async for message in client.messages:
            if isinstance(message.payload, bytes):
                ear.hear(message.payload)


async def _end(task: asyncio.Task[None]) -> None:
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


async def _leave(client: aiomqtt.Client) -> None:
    with contextlib.suppress(aiomqtt.MqttError):
        await client.__aexit__(None, None, None)
