"""A door on loopback through which tests break things: small HTTP, JSON orders.

``POST /`` with a ``FaultOrder`` or a ``PersonOrder``; 204 when done, 400 when it cannot
be read, 409 when it cannot be done.  Not for production: it opens on 127.0.0.1 alone,
and only when asked for.
"""

import asyncio
from collections.abc import Callable
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from iveg.domain.errors import SettingsError

_LARGEST_BODY = 4096
_PATIENCE_S = 5.0


class _Order(BaseModel):
    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True
    )


class Place(_Order):
    """A point in ``map`` (m)."""

    x: float
    y: float


class FaultOrder(_Order):
    """What goes wrong with one robot; a field that is absent changes nothing.

    Attributes:
        mute: Publishes nothing; ``deaf``: drives as it likes whatever iVeg says.
        freeze_odometry: Its odometry falls silent; everything else goes on.
        clock_offset_s: Its wall clock is this far ahead (s).
        local_hold: Somebody presses its red button, or it bumps.
        release_locally: The crew lifts those, and its boot hold.
        kill: Its software dies; ``revive`` starts it anew, held.
        false_person: Its camera sees a person there; null ends that.
        hide_people: Its camera sees no person.
    """

    robot: str
    mute: bool | None = None
    deaf: bool | None = None
    freeze_odometry: bool | None = None
    clock_offset_s: float | None = None
    local_hold: Literal["hw", "bumper"] | None = None
    release_locally: bool = False
    kill: bool = False
    revive: bool = False
    false_person: Place | None = None
    hide_people: bool | None = None


class PersonOrder(_Order):
    """Puts one person somewhere; with ``hold`` to stay there.

    Attributes:
        person: Counted from 0.
        x: In ``map`` (m); ``y`` likewise.
    """

    person: int = Field(ge=0)
    x: float
    y: float
    hold: bool = False


Obey = Callable[[FaultOrder | PersonOrder], str | None]
_ORDER: TypeAdapter[FaultOrder | PersonOrder] = TypeAdapter(FaultOrder | PersonOrder)


async def open_faults(port: int, obey: Obey) -> tuple[asyncio.Server, int]:
    """Open the door; orders are taken from now on, until the server is closed.

    Args:
        port: 0 takes a free one.
        obey: Does what an order says; returns why it cannot.

    Returns:
        The server and its port.

    Raises:
        SettingsError: somebody listens there already.
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
            pass  # a visitor who left is no concern of the robots
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
        order = _ORDER.validate_json(body)
    except ValidationError as error:
        return "400 Bad Request", error.errors(include_input=False)[0]["msg"]
    why = obey(order)
    return ("204 No Content", "") if why is None else ("409 Conflict", why)
