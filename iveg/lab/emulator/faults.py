"""HTTP endpoint on loopback through which tests inject faults, with JSON orders.

``POST /`` with a ``FaultOrder`` or a ``PersonOrder``; 204 when done, 400 when it cannot
be read, with a sentence that names the field, 409 when it cannot be done.  Not for
production: it listens on 127.0.0.1 alone, and only on request.
"""

import asyncio
from collections.abc import Callable

from iveg.domain.errors import SettingsError, UnreadableError
from iveg.lab.emulator.orders import Order, read_order

_LARGEST_BODY = 4096
_PATIENCE_S = 5.0


Obey = Callable[[Order], str | None]


async def open_fault_port(port: int, obey: Obey) -> tuple[asyncio.Server, int]:
    """Open the endpoint; orders are accepted until the server is closed.

    Args:
        port: 0 takes a free one.
        obey: Executes an order; returns the reason if it cannot.

    Returns:
        The server and its port.

    Raises:
        SettingsError: the port is in use.
    """

    async def visit(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            async with asyncio.timeout(_PATIENCE_S):
                status, text = _answer(await _read_body(reader), obey)
            body = text.encode()
            head = f"HTTP/1.1 {status}\r\nContent-Length: {len(body)}\r\n"
            writer.write(f"{head}Connection: close\r\n\r\n".encode() + body)
            await writer.drain()
        except (ConnectionError, TimeoutError, asyncio.IncompleteReadError):
            pass  # a closed connection does not concern the robots
        finally:
            writer.close()

    try:
        server = await asyncio.start_server(visit, "127.0.0.1", port)
    except OSError as error:
        allowed = "a port of 127.0.0.1 that nobody listens on"
        raise SettingsError("fault_port", str(port), allowed) from error
    return server, server.sockets[0].getsockname()[1]


async def _read_body(reader: asyncio.StreamReader) -> bytes:
    """The body of one request; empty where it is not a POST of reasonable size."""
    first = await reader.readline()
    length = 0
    while (line := (await reader.readline()).strip()) != b"":
        name, _, value = line.partition(b":")
        if name.lower() == b"content-length" and value.strip().isdigit():
            length = int(value)
    if not first.startswith(b"POST ") or length > _LARGEST_BODY:
        return b""
    return await reader.readexactly(length)


def _answer(body: bytes, obey: Obey) -> tuple[str, str]:
    try:
        order = read_order(body)
    except UnreadableError as error:
        return "400 Bad Request", str(error)
    why = obey(order)
    return ("204 No Content", "") if why is None else ("409 Conflict", why)
