"""What stands between programs that run for real, so that one of them can be broken.

A gate lets everything through until it is told otherwise; whoever is inside when that
happens is thrown out.  The bridge is the agent's connection to the robots' broker,
which the embedded agent, a call away from its own, does not have.
"""

import asyncio
import contextlib
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.errors import HopError
from tests.threads import running

Mood = Literal["open", "shut", "slow", "hanging", "odd"]
SLOW_S = 2.0
_LENGTH = re.compile(rb"\r\ncontent-length: *(\d+)", re.IGNORECASE)
_ODD = (
    b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n"
    b"Fiware-Total-Count: many\r\nContent-Length: 7\r\n\r\n[7,[8]]"
)
"""JSON that nobody can use."""


class Gate:
    """Passes TCP on to a port of this machine; its moods are HTTP's.

    Attributes:
        port: Where clients knock.
    """

    def __init__(self, target: int) -> None:
        self._target = target
        self._mood: Mood = "open"
        self._loop = asyncio.new_event_loop()
        self._server: asyncio.Server | None = None
        self._inside: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self.port = 0

    def open(self) -> None:
        """Start to pass things on."""
        self._thread.start()
        self.be("open")

    def be(self, mood: Mood) -> None:
        """From now on; returns when it is so."""
        done = asyncio.run_coroutine_threadsafe(self._be(mood), self._loop)
        done.result(10.0)

    def close(self) -> None:
        """Throw everybody out and leave."""
        self.be("shut")
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10.0)
        self._loop.close()

    async def _be(self, mood: Mood) -> None:
        self._mood = mood
        if self._server is not None:
            # Who is at the threshold comes in first: CPython 3.11 loses the socket of
            # a connection whose server is closed between its accept and its start.
            for door in self._server.sockets:
                self._loop.remove_reader(door.fileno())
            await _a_few_turns()
            self._server.close()
            self._server = None
        inside = list(self._inside)
        for task in inside:
            task.cancel()
        await asyncio.gather(*inside, return_exceptions=True)
        await _a_few_turns()
        if mood != "shut":
            self._server = await asyncio.start_server(
                self._enter, "127.0.0.1", self.port
            )
            self.port = int(self._server.sockets[0].getsockname()[1])

    async def _enter(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._inside.add(task)
        try:
            with contextlib.suppress(OSError, asyncio.IncompleteReadError):
                await self._serve(reader, writer)
        except asyncio.CancelledError:
            # Thrown out; the server would call that an error.
            return
        finally:
            self._inside.discard(task)
            writer.close()

    async def _serve(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        if self._mood == "shut":
            return
        if self._mood == "hanging":
            await asyncio.Event().wait()
        elif self._mood == "odd":
            await _answer(reader, writer)
        else:
            delay_s = SLOW_S if self._mood == "slow" else 0.0
            await self._pass_on(reader, writer, delay_s)

    async def _pass_on(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        delay_s: float,
    ) -> None:
        there, back = await asyncio.open_connection("127.0.0.1", self._target)
        ways = [
            asyncio.create_task(_copy(reader, back, 0.0)),
            asyncio.create_task(_copy(there, writer, delay_s)),
        ]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)
            back.close()


async def _a_few_turns() -> None:
    """Let what has begun in the loop go on: a start, an end, the word of it."""
    for _ in range(4):
        await asyncio.sleep(0.0)


async def _copy(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, delay_s: float
) -> None:
    while data := await reader.read(65536):
        await asyncio.sleep(delay_s)
        writer.write(data)
        await writer.drain()


async def _answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """The same to every request of a connection."""
    while True:
        head = await reader.readuntil(b"\r\n\r\n")
        length = _LENGTH.search(head)
        await reader.readexactly(int(length[1]) if length else 0)
        writer.write(_ODD)


class Bridge:
    """Measures and answers to the broker behind, commands to the one in front.

    Like the agent it connects again by itself, and what comes meanwhile is lost.

    Args:
        per_s: So many messages a second reach the broker behind, in order, and what
            comes faster waits without bound, as in a real agent; None: all at once.
    """

    def __init__(
        self, front: BrokerAddress, behind: BrokerAddress, per_s: float | None = None
    ) -> None:
        self._per_s = per_s
        self._waiting: asyncio.Queue[tuple[str, bytes]] = asyncio.Queue()
        self._tasks: set[asyncio.Task[None]] = set()
        self._front = MqttLink(
            front,
            "bridge-front",
            {"/+/+/attrs": 0, "/+/+/cmdexe": 1},
            self._take,
        )
        self._behind = MqttLink(
            behind,
            "bridge-behind",
            {"/+/+/cmd": 1},
            lambda topic, payload: self._pass_on(self._front, topic, payload),
        )

    async def run(self) -> None:
        """Until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._front.run())
            tasks.create_task(self._behind.run())
            tasks.create_task(self._carry())

    def _take(self, topic: str, payload: bytes) -> None:
        if self._per_s is None:
            self._pass_on(self._behind, topic, payload)
        else:
            self._waiting.put_nowait((topic, payload))

    async def _carry(self) -> None:
        """One after the other, each at its time."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            topic, payload = await self._waiting.get()
            due = max(due, loop.time() - 0.1) + 1.0 / (self._per_s or 1.0)
            await asyncio.sleep(due - loop.time())
            self._pass_on(self._behind, topic, payload)

    def _pass_on(self, link: MqttLink, topic: str, payload: bytes) -> None:
        task = asyncio.get_running_loop().create_task(_publish(link, topic, payload))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


async def _publish(link: MqttLink, topic: str, payload: bytes) -> None:
    with contextlib.suppress(HopError):
        await link.publish(topic, payload, qos=0)


@contextmanager
def bridge(
    front: BrokerAddress, behind: BrokerAddress, per_s: float | None = None
) -> Iterator[None]:
    """A bridge that runs in a thread of its own."""
    with running(Bridge(front, behind, per_s).run(), "bridge"):
        yield


@contextmanager
def gate(target: int) -> Iterator[Gate]:
    """An open gate before a port."""
    found = Gate(target)
    found.open()
    try:
        yield found
    finally:
        found.close()
