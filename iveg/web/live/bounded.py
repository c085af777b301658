"""A WebSocket with small buffers on this side.

Data that the kernel and the server hold for a slow browser form a queue in front of the
slots where the newest wins.  Credit bounds it for telemetry; here it is bounded for all
else, too.
"""

import asyncio
import socket
from typing import Final

from uvicorn.protocols.websockets.websockets_sansio_impl import (
    WebSocketsSansIOProtocol,
)

SEND_BUFFER: Final = 65536
"""In the kernel (bytes, Linux doubles it): 0.2 MB/s over a round trip of 300 ms."""


class BoundedSocket(WebSocketsSansIOProtocol):
    """Sends a message when the kernel has taken all of the one before."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called once the connection speaks WebSocket."""
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(high=0)
        kernel: socket.socket | None = transport.get_extra_info("socket")
        if kernel is not None:
            kernel.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
