"""A listener for a few POSTs, as Orion's notification of a probe."""

import asyncio
import re
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

_LENGTH = re.compile(rb"content-length: *(\d+)", re.IGNORECASE)
_NO_CONTENT = b"HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n"


@asynccontextmanager
async def post_listener(hear: Callable[[bytes], None], host: str) -> AsyncIterator[int]:
    """Accept POSTs while the block lasts.

    Args:
        hear: Called with the body of each.
        host: Address to bind.

    Yields:
        The port, a free one.
    """

    async def accept(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        try:
            head = await reader.readuntil(b"\r\n\r\n")
            length = _LENGTH.search(head)
            hear(await reader.readexactly(int(length[1]) if length else 0))
            writer.write(_NO_CONTENT)
        except (asyncio.IncompleteReadError, asyncio.LimitOverrunError, OSError):
            return  # no POST; somebody else who tries this port
        finally:
            writer.close()

    async with await asyncio.start_server(accept, host, 0) as server:
        port: int = server.sockets[0].getsockname()[1]
        yield port
