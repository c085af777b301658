"""HTTP of the server: the newest connection comes in, the oldest idle one goes.

So a STOP gets through while somebody holds a thousand half-sent requests open.  All
other limits are a proxy's (docs/deployment.md, "TLS").  An open WebSocket is never
displaced: it is not counted.
"""

import asyncio
import logging
from typing import Final

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

MOST: Final = 512
HEAD_S: Final = 5.0
MOST_HELD: Final = 65_536
"""Bytes of a head, a trailer or the size of a chunk, which the parser holds."""

# It says so for each; the answer says it, too.
logging.getLogger("uvicorn.error").addFilter(
    lambda record: record.getMessage() != "Invalid HTTP request received."
)


class BoundedHttp(HttpToolsProtocol):
    """One connection of anybody's; ``bounded_http`` makes the class of a server.

    Attributes:
        table: All of the server, the one that was quiet longest first.
        most: How many there may be.
        head_s: Time in which a head has to be here (s).
    """

    table: dict["BoundedHttp", None]
    most = MOST
    head_s = HEAD_S
    _timer: asyncio.TimerHandle | None = None
    _lacks_head = True
    _held = 0

    def connection_made(  # type: ignore[override]
        self, transport: asyncio.Transport
    ) -> None:
        """Somebody has connected."""
        super().connection_made(transport)
        self.table[self] = None
        self._await_head()
        if len(self.table) > self.most:
            idle = (
                connection
                for connection in self.table
                if connection.is_idle and connection is not self
            )
            next(idle, next(iter(self.table))).give_way()

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is closed."""
        self._leave()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Bytes have come."""
        self._held += len(data)
        super().data_received(data)
        if self._held > MOST_HELD:
            self.give_way()
        elif self._lacks_head:
            self._await_head()

    def on_message_begin(self) -> None:
        """A request begins."""
        super().on_message_begin()
        self._lacks_head = True
        self._leave()
        self.table[self] = None

    def on_headers_complete(self) -> None:
        """The head is here."""
        self._held = 0
        self._lacks_head = False
        self._end_timer()
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """A part of a body."""
        self._held = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        """The request is whole."""
        self._held = 0
        super().on_message_complete()

    def handle_websocket_upgrade(self) -> None:
        """It speaks WebSocket from now on."""
        self._leave()
        super().handle_websocket_upgrade()

    @property
    def is_idle(self) -> bool:
        """Whether no whole request is being answered."""
        cycle = self.cycle
        return cycle is None or cycle.response_complete or cycle.more_body

    def give_way(self) -> None:
        """End it without waiting for anything."""
        self._leave()
        self.transport.abort()

    def _await_head(self) -> None:
        """Bound the time of a head that has not come whole; more bytes prolong none."""
        if self._timer is None:
            self._timer = self.loop.call_later(self.head_s, self.give_way)

    def _leave(self) -> None:
        self.table.pop(self, None)
        self._end_timer()

    def _end_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


def bounded_http(most: int = MOST, head_s: float = HEAD_S) -> type[BoundedHttp]:
    """The protocol of a server, with connections of its own."""
    own = {"table": {}, "most": most, "head_s": head_s}
    return type("BoundHttp", (BoundedHttp,), own)
