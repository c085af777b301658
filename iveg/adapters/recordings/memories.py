"""The memory of a pipeline as it is recorded: JSON, in it zlib and base64.

It is made where recordings are written: the loop hands over bytes as they are, and
these in pieces, so that nothing waits for a whole memory.
"""

import zlib
from base64 import b64decode, b64encode
from collections.abc import Mapping
from typing import Any, Final

import orjson

from iveg.domain.errors import UnreadableError

_QUICK: Final = 1
"""The level that takes least time, as there is a memory every two seconds."""
_MOST_BYTES: Final = 1 << 26


def packed(about: bytes, memory: bytes) -> bytes:
    """What is told of a memory (JSON), and the memory, on their way to the writer."""
    return b"\n".join((about, memory))


def recorded(came: bytes) -> bytes:
    """What came ``packed``, as one JSON."""
    about, _, memory = came.partition(b"\n")
    text = b64encode(zlib.compress(memory, _QUICK)).decode()
    return orjson.dumps({**orjson.loads(about), "memory": text})


def memory_in(record: Mapping[str, Any]) -> bytes:
    """The memory in what was ``recorded``.

    Raises:
        UnreadableError: it is cut off, too large or nothing of the kind.
    """
    try:
        return _unpacked(b64decode(record["memory"]))
    except (LookupError, TypeError, ValueError, zlib.error) as error:
        raise UnreadableError("memory", repr(error)) from error


def _unpacked(data: bytes) -> bytes:
    """What was compressed, as far as any memory can be large."""
    unpacking = zlib.decompressobj()
    whole = unpacking.decompress(data, _MOST_BYTES)
    if not unpacking.eof:
        raise LookupError("cut off, or too large")
    return whole
