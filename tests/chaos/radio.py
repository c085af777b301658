"""A TCP proxy that stands where the radio does: late, lossy, and cut at any moment.

Bytes keep their order, as TCP keeps it; what the network loses comes later, together
with what was written behind it meanwhile, and what a reset takes is gone with its
connection.
"""

import asyncio
import contextlib
import socket
from dataclasses import dataclass
from random import Random

from tests.threads import running

_CHUNK = 65_536
_RESET_EVERY_S = 2.0
_AGAIN_S = 0.3
"""After this long TCP sends again what was lost."""


@dataclass(frozen=True)
class Weather:
    """What happens to each piece of a stream, and to its connection.

    Attributes:
        late_s: Every piece takes this long, give or take ``jitter_s``.
        lost: Share of the pieces that have to be sent again; nothing is read behind
            one meanwhile.
        reset: Chance of a connection, every two seconds, to be reset.
        bytes_per_s: What the line carries each way; what is more waits, without end.
    """

    late_s: float = 0.0
    jitter_s: float = 0.0
    lost: float = 0.0
    reset: float = 0.0
    bytes_per_s: float = float("inf")

    def delay(self, rnd: Random) -> float:
        """How long this piece takes when it is not lost (s)."""
        return max(0.0, self.late_s + rnd.uniform(-self.jitter_s, self.jitter_s))

    def repeat(self, rnd: Random) -> float:
        """How long it takes until a piece has not been lost (s).

        As with TCP, whose window closes, one loss holds up all that follows, and those
        bytes then are one piece: how many pieces there are, and so how many are lost,
        does not depend on how fast this machine reads.
        """
        waited = 0.0
        while rnd.random() < self.lost:
            waited += _AGAIN_S
        return waited


FAIR = Weather()
LATE = Weather(late_s=0.5, jitter_s=0.2)
LOSSY = Weather(lost=0.3, reset=0.3)


class Radio:
    """Passes connections on to a broker, in a thread of its own.

    Attributes:
        port: Where robots connect to.
        weather: Read for every piece, so it can change at any moment.
        resets: Connections that were reset.
    """

    def __init__(self, broker: int, seed: int = 1) -> None:
        self.weather = FAIR
        self.resets = 0
        self._broker = broker
        self._rnd = Random(seed)  # noqa: S311 - repeatable on purpose
        self._open: set[asyncio.StreamWriter] = set()
        self._carrying: set[asyncio.Task[None]] = set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._life = contextlib.ExitStack()

    def __enter__(self) -> "Radio":
        self._life.enter_context(running(self._serve(), "radio"))
        return self

    def __exit__(self, *_: object) -> None:
        self._life.close()

    async def _serve(self) -> None:
        server = await asyncio.start_server(self._accept, sock=self._listener)
        try:
            while True:
                await asyncio.sleep(_RESET_EVERY_S)
                for writer in list(self._open):
                    if self._rnd.random() < self.weather.reset:
                        self.resets += 1
                        writer.transport.abort()
        finally:
            server.close()
            for carrier in self._carrying:
                carrier.cancel()
            for writer in list(self._open):
                writer.transport.abort()
            # A last turn for those that carried them.
            await asyncio.sleep(0.05)

    async def _accept(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self._open.add(writer)
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self._broker)
        except OSError:
            writer.transport.abort()
            self._open.discard(writer)
            return
        carrying = [
            asyncio.create_task(self._carry(reader, back)),
            asyncio.create_task(self._carry(there, writer)),
        ]
        self._carrying.update(carrying)
        await asyncio.wait(carrying, return_when=asyncio.FIRST_COMPLETED)
        self._carrying.difference_update(carrying)
        for task in carrying:
            task.cancel()
        self._open.discard(writer)
        for one in (writer, back):
            one.transport.abort()

    async def _carry(
        self, source: asyncio.StreamReader, sink: asyncio.StreamWriter
    ) -> None:
        """Every piece at its time, none before the one that came before it."""
        pieces: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(1000)
        passing = asyncio.create_task(self._pass_on(pieces, sink))
        last, free = 0.0, 0.0
        try:
            while piece := await source.read(_CHUNK):
                await asyncio.sleep(self.weather.repeat(self._rnd))
                free = max(free, _now())
                free += len(piece) / self.weather.bytes_per_s
                last = max(last, free + self.weather.delay(self._rnd))
                await pieces.put((last, piece))
            # The end comes after what was said before it.
            await pieces.put((last, b""))
            await passing
        except OSError:
            return
        finally:
            passing.cancel()

    async def _pass_on(
        self, pieces: asyncio.Queue[tuple[float, bytes]], sink: asyncio.StreamWriter
    ) -> None:
        while True:
            due, piece = await pieces.get()
            await asyncio.sleep(max(0.0, due - _now()))
            if not piece or sink.is_closing():
                return
            with contextlib.suppress(OSError):
                sink.write(piece)
                await sink.drain()


def _now() -> float:
    return asyncio.get_running_loop().time()
