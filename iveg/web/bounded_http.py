"""HTTP protocol of the server with bounds: size and time of a head, connections.

The parser holds a header until its end, and the server every connection: an endless
header would take all memory, and half-sent requests every place (SECURITY.md).
"""

import asyncio
import logging
from typing import Final

from uvicorn.protocols.http.httptools_impl import STATUS_LINE

from iveg.adapters.connections import CONNECTION, Connection, ConnectionTable
from iveg.web.notification_http import NotificationHttp
from iveg.web.notifications import NotificationEndpoint

_PIECE: Final = 16384
_TOO_LONG: Final = b"".join(
    (STATUS_LINE[431], b"content-length: 0\r\nconnection: close\r\n\r\n")
)


# It says so for each; here the first of an address is logged and all are counted.
logging.getLogger("uvicorn.error").addFilter(
    lambda record: record.getMessage() != "Invalid HTTP request received."
)


def bounded_http(
    endpoint: NotificationEndpoint, table: ConnectionTable
) -> type["BoundedHttp"]:
    """The protocol of a server.

    Args:
        endpoint: Where its notifications go.
        table: Its connections.
    """

    class BoundHttp(BoundedHttp):
        """Of this server."""

    BoundHttp.endpoint, BoundHttp.table = endpoint, table
    return BoundHttp


class _HeadTooLongError(Exception):
    """Leaves the parser, which passes it on as a request that cannot be read."""


class BoundedHttp(NotificationHttp):
    """One connection of anybody's.

    Attributes:
        table: Of the connection's server.
    """

    table: ConnectionTable
    _connection: Connection | None = None
    _most = 0
    """Bytes that a head may have."""
    _is_too_long = False
    _unparsed = 0
    """Bytes since the parser last finished a head, a part of a body, or a request."""

    def connection_made(  # type: ignore[override]
        self, transport: asyncio.Transport
    ) -> None:
        """Somebody has connected."""
        super().connection_made(transport)
        self._most = self.table.caps.head_bytes
        peer = "" if self.client is None else self.client[0]
        self._connection = self.table.admit(peer, transport.abort)
        if self._connection is None:
            transport.abort()
            return
        self.app_state = {**self.app_state, CONNECTION: self._connection}

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is closed."""
        super().connection_lost(exc)
        if self._connection is not None:
            self._connection.leave()

    def data_received(self, data: bytes) -> None:
        """Bytes have come."""
        if len(data) <= _PIECE:
            self._feed(data)
            return
        for start in range(0, len(data), _PIECE):
            self._feed(data[start : start + _PIECE])

    def _feed(self, data: bytes) -> None:
        """Give bytes to the parser, and end a head that it still looks for the end of.

        How much of these the parser has used nobody knows, so they are few.
        """
        connection = self._connection
        if connection is None or self.transport.is_closing():
            return
        if connection.is_idle:
            # Also for blank lines, which the parser passes over.
            connection.await_head()
        self._unparsed += len(data)
        super().data_received(data)
        if self._unparsed > self._most and not self.transport.is_closing():
            self._is_too_long = True
            self.send_400_response("")

    def send_400_response(self, msg: str) -> None:
        """Refuse what cannot be read; 431 where it is the length of the head."""
        address = "" if self._connection is None else self._connection.address
        if not self._is_too_long:
            self.table.refused(address, "unreadable")
            super().send_400_response(msg)
            return
        self.table.refused(address, "head_too_long")
        self.transport.write(_TOO_LONG)
        self.transport.close()

    # --- what the parser finds ----------------------------------------------------

    def on_message_begin(self) -> None:
        """A request begins."""
        connection = self._connection
        if connection is not None and connection.is_busy:
            # It came behind one that is still being answered.
            connection.await_head()
        super().on_message_begin()

    def on_headers_complete(self) -> None:
        """The head is here."""
        self._unparsed = 0
        size = sum([len(name) + len(value) for name, value in self.headers])
        if size + len(self.url) > self._most:
            self._is_too_long = True
            raise _HeadTooLongError
        if self._connection is not None:
            self._connection.await_body()
        super().on_headers_complete()
        if self._connection is not None and self.is_notification:
            self._connection.vouch()

    def on_body(self, body: bytes) -> None:
        """A part of a body."""
        self._unparsed = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        """The request is whole."""
        self._unparsed = 0
        if self._connection is not None:
            self._connection.serve()
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """The answer is out."""
        super().on_response_complete()
        if self._connection is not None and not self.pipeline:
            self._connection.rest()
