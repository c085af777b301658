"""A page's account of a press, read so that nothing in it can refuse a STOP.

The keys are the same over HTTP and WebSocket (docs/interfaces/http.md).
"""

import asyncio
import math

from starlette.requests import ClientDisconnect, Request

from iveg.domain.errors import UnreadableError
from iveg.domain.stop import Press
from iveg.ngsi.codec import load_json

_LONGEST_ID = 64
_BODY_WITHIN_S = 0.25
_LARGEST_BODY = 4096

DESCRIBED: dict[str, object] = {
    "requestBody": {
        "required": False,
        "description": "What the page knows of the press; never a reason to refuse.",
        "content": {
            "application/json": {
                "schema": {
                    "type": "object",
                    "properties": {
                        "press_id": {
                            "type": "string",
                            "maxLength": _LONGEST_ID,
                            "description": "The same at every repetition.",
                        },
                        "pressed_at": {
                            "type": "number",
                            "description": "Unix time (s), offset-corrected.",
                        },
                    },
                }
            }
        },
    }
}


async def press_of(request: Request) -> Press:
    """The press in a request's body; none in a late or unreadable body."""
    try:
        async with asyncio.timeout(_BODY_WITHIN_S):
            # A slow line must not hold a STOP up: it goes without the page's account.
            body = await request.body()
        return read_press(load_json(body) if 0 < len(body) <= _LARGEST_BODY else None)
    except (TimeoutError, ClientDisconnect, UnreadableError):
        return Press()


def read_press(value: object) -> Press:
    """The press in a message; unusable values are left out."""
    if not isinstance(value, dict):
        return Press()
    press_id = value.get("press_id")
    named = isinstance(press_id, str) and 0 < len(press_id) <= _LONGEST_ID
    return Press(press_id if named else None, read_number(value.get("pressed_at")))


def read_number(value: object) -> float | None:
    """A finite number that a page sent; None for anything else."""
    # Python counts True as a number; JSON does not.
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        number = float(value)
    except OverflowError:
        # JSON's whole numbers have no bound, a float has one.
        return None
    return number if math.isfinite(number) else None
