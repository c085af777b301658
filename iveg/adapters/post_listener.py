"""A listener for single POSTs: notifications, and orders to the emulator."""

import asyncio
import re
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from http import HTTPStatus

_LENGTH = re.compile(rb"content-length: *(\d+)", re.IGNORECASE)
_LARGEST_BODY = 65536
_PATIENCE_S = 5.0


@asynccontextmanager
async def post_listener(
    answer: Callable[[bytes], tuple[HTTPStatus, str]], host: str, port: int = 0
) -> AsyncIterator[int]:
    """Accept POSTs, one for each connection, while the block lasts.

    Args:
        answer: Called with the body, empty where it is not a POST of reasonable size;
            returns the status and the text of the response.
        host: Address to bind.
        port: TCP port; 0 for a free one.

    Yields:
        The port in use.

    Raises:
        OSError: the port is in use.
    """

    async def visit(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            async with asyncio.timeout(_PATIENCE_S):
                status, text = answer(await _read_body(reader))
            head = f"HTTP/1.1 {status.value} {status.phrase}\r\nConnection: close\r\n"
            body = text.encode()
            writer.write(f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body)
            await writer.drain()
        except (OSError, EOFError, asyncio.LimitOverrunError):
            pass  # a connection that is closed or sends something else is nobody's
        finally:
            writer.close()

    async with await asyncio.start_server(visit, host, port) as server:
        bound: int = server.sockets[0].getsockname()[1]
        yield bound


async def _read_body(reader: asyncio.StreamReader) -> bytes:
    head = await reader.readuntil(b"\r\n\r\n")
    found = _LENGTH.search(head)
    length = int(found[1]) if found else 0
    if not head.startswith(b"POST ") or length > _LARGEST_BODY:
        return b""
    return await reader.readexactly(length)
