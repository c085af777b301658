"""Relay on loopback that applies a faulty radio between a robot and the broker.

The robot's own software connects here without knowing, so that the tests run the
software of a real robot.  Messages of the broker pass unchanged.
"""

import asyncio
import contextlib
import ssl
from types import TracebackType

from iveg.adapters import clock
from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.mqtt_packets import packet_bounds, puback_packet
from iveg.lab.emulator.radio import Packet, Radio

_PUBLISH = 3
_MOST_WAITING = 4000
"""Packets on the way: ten seconds of all topics at 30 Hz, thrice over."""
_CHUNK = 65536


class Relay:
    """Relay for one robot; use it with ``async with``.

    Args:
        broker: Address of the broker.
        radio: Decides the fate of its packets.

    Attributes:
        address: Address for the robot, once the relay is open.
    """

    def __init__(self, broker: BrokerAddress, radio: Radio) -> None:
        self.radio = radio
        self.address = broker
        self._broker = broker
        self._visits: set[asyncio.Task[None]] = set()

    async def __aenter__(self) -> "Relay":
        self._server = await asyncio.start_server(self._visit, "127.0.0.1", 0)
        host, port = self._server.sockets[0].getsockname()
        self.address = BrokerAddress(
            host, port, self._broker.user, self._broker.password
        )
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.close()
        for visit in self._visits:
            visit.cancel()
        await asyncio.gather(*self._visits, return_exceptions=True)

    async def _visit(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        task = asyncio.current_task()
        assert task is not None  # noqa: S101 - a coroutine that runs is in a task
        self._visits.add(task)
        try:
            # The broker is unreachable or closes: the robot's connection is closed.
            with contextlib.suppress(OSError, asyncio.IncompleteReadError):
                await self._connect(reader, writer)
        except asyncio.CancelledError:
            pass  # the relay closes; nobody awaits this task's result
        finally:
            self._visits.discard(task)
            writer.close()

    async def _connect(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        tls = ssl.create_default_context() if self._broker.tls else None
        down, up = await asyncio.open_connection(
            self._broker.host, self._broker.port, ssl=tls
        )
        try:
            await self._carry(reader, writer, down, up)
        finally:
            up.close()

    async def _carry(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        down: asyncio.StreamReader,
        up: asyncio.StreamWriter,
    ) -> None:
        """Forward both directions until one end closes."""
        waiting: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(_MOST_WAITING)
        ways = [
            asyncio.create_task(way, name=f"relay-{name}")
            for name, way in (
                ("down", _copy(down, writer)),
                ("up", self._pass_up(reader, writer, up, waiting)),
                ("late", _send_when_due(waiting, up)),
            )
        ]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)

    async def _pass_up(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        up: asyncio.StreamWriter,
        waiting: asyncio.Queue[tuple[float, bytes]],
    ) -> None:
        while True:
            packet = await read_packet(reader)
            passed = self.radio.pass_on(packet, clock.mono())
            if packet.receipt and not passed:
                # Swallowed: without it the robot's software would wait for the broker.
                writer.write(packet.receipt)
            for due, raw in passed:
                if packet.topic is None:
                    up.write(raw)
                elif not waiting.full():
                    waiting.put_nowait((due, raw))
            await up.drain()


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(_CHUNK):
        writer.write(data)
        await writer.drain()


async def _send_when_due(
    waiting: asyncio.Queue[tuple[float, bytes]], up: asyncio.StreamWriter
) -> None:
    while True:
        due, raw = await waiting.get()
        late = due - clock.mono()
        if late > 0.0:
            await asyncio.sleep(late)
        up.write(raw)
        await up.drain()


async def read_packet(reader: asyncio.StreamReader) -> Packet:
    """Read one packet of MQTT 3.1.1: type and flags, length of 1 to 4 bytes, the rest.

    Raises:
        asyncio.IncompleteReadError: the sender has closed.
    """
    raw = await reader.readexactly(2)
    begin, end = packet_bounds(raw, 0)
    while end == 0:
        raw += await reader.readexactly(1)
        begin, end = packet_bounds(raw, 0)
    rest = await reader.readexactly(end - begin)
    if raw[0] >> 4 != _PUBLISH:
        return Packet(None, 0, raw + rest)
    size = int.from_bytes(rest[:2], "big")
    topic = rest[2 : 2 + size].decode("utf-8", "replace")
    qos = raw[0] >> 1 & 3
    receipt = puback_packet(rest[2 + size : 4 + size]) if qos == 1 else b""
    return Packet(topic, qos, raw + rest, receipt)
