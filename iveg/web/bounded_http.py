"""HTTP of the server: the newest connection comes in, the oldest idle one goes.

So a STOP gets through while somebody holds a thousand half-sent requests open.  All
other limits are a proxy's (docs/deployment.md, "TLS").  An open WebSocket does not
count and is never closed for a newer connection.
"""

import asyncio
import logging
from typing import Final

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

MOST: Final = 512
HEAD_S: Final = 5.0
MOST_HELD: Final = 65_536
"""Bytes of a head, a trailer or a chunk's size, which the parser keeps in memory."""

# One line for each bad request would fill the log; the answer says it anyway.
logging.getLogger("uvicorn.error").addFilter(
    lambda record: record.getMessage() != "Invalid HTTP request received."
)


class BoundedHttp(HttpToolsProtocol):
    """One connection; ``bounded_http`` makes the class of each server.

    Attributes:
        table: Connections of the server, by the begin of their last request.
        most: Number of connections that there may be.
        head_s: Time in which a head has to be complete (s).
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
        """Count a new connection, and end another where there are too many."""
        super().connection_made(transport)
        self.table[self] = None
        self._await_head()
        if len(self.table) > self.most:
            idle = (
                connection
                for connection in self.table
                if connection.is_idle and connection is not self
            )
            # Without an idle connection the oldest goes, so that the newest comes in.
            next(idle, next(iter(self.table))).give_way()

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is closed."""
        self._leave()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take bytes, and bound how many the parser holds."""
        self._held += len(data)
        super().data_received(data)
        if self._held > MOST_HELD:
            self.give_way()
        elif self._lacks_head:
            self._await_head()

    def on_message_begin(self) -> None:
        """Note that a request begins, which makes its connection the newest."""
        super().on_message_begin()
        self._lacks_head = True
        # To the end of the table: it is now the newest.
        self._leave()
        self.table[self] = None

    def on_headers_complete(self) -> None:
        """Note that the head is complete."""
        self._held = 0
        self._lacks_head = False
        self._end_timer()
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Take a part of a body, which the parser does not hold."""
        self._held = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        """Note that the request is complete."""
        self._held = 0
        super().on_message_complete()

    def handle_websocket_upgrade(self) -> None:
        """Hand the connection over to WebSocket; it no longer counts."""
        self._leave()
        super().handle_websocket_upgrade()

    @property
    def is_idle(self) -> bool:
        """Whether no complete request is being answered."""
        cycle = self.cycle
        return cycle is None or cycle.response_complete or cycle.more_body

    def give_way(self) -> None:
        """Abort the connection at once."""
        self._leave()
        self.transport.abort()

    def _await_head(self) -> None:
        """Bound the time of an incomplete head; further bytes do not prolong it."""
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
