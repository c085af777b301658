"""Plain CDR, the bytes of a ROS 2 message in both byte orders, by rosbags.

rosbags has the definitions of ROS 2 Jazzy.  It is told those of detectors, and to make
messages of ours.  Arrays that are read are views of the payload, sequences are lists.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import fields
from functools import cache
from typing import Any, TypeVar, get_args, get_type_hints

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from iveg.domain.errors import UnreadableError
from iveg.ros2.detector_messages import NUMBERED, TEXTS
from iveg.ros2.messages import Message, definitions

_M = TypeVar("_M", bound=Message)


def read(message: type[_M], payload: bytes) -> _M:
    """Read one message, after which up to three bytes of padding may come.

    Args:
        message: Its type; of several definitions the newest counts that fits.
        payload: With its encapsulation.

    Raises:
        UnreadableError: bytes that this type does not describe.
    """
    for form in definitions(message):
        with suppress(SerdeError):
            found: Any = store_of(form).deserialize_cdr(memoryview(payload), form.ROS)
            if form is not message:
                found = message(*(getattr(found, one.name) for one in fields(message)))
            made: _M = found
            return made
    raise UnreadableError("unreadable", f"{message.ROS} of {len(payload)} bytes")


def write(message: Message) -> bytes:
    """The bytes of one message, with its encapsulation; the lowest comes first."""
    store = store_of(type(message))
    return bytes(store.serialize_cdr(message, message.ROS, little_endian=True))


@cache
def store_of(message: type[Message]) -> Any:
    """The definitions of a message and of all within it, ready for its bytes."""
    kinds = {one.ROS: one for one in _within(message)}
    store = _store(any(one.__name__ == NUMBERED for one in kinds.values()))
    store.types.update(kinds)
    # Codecs take a tenth of a second, which no twist should wait for.
    store.get_msgdef(message.ROS)
    return store


@cache
def _store(numbered: bool) -> Any:
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in TEXTS[numbered].items():
        store.register(get_types_from_msg(text, name))
    return store


def _within(message: type[Message]) -> Iterator[type[Message]]:
    """A message and those within it."""
    yield message
    for hint in get_type_hints(message).values():
        for kind in (hint, *get_args(hint)):
            if isinstance(kind, type) and issubclass(kind, Message):
                yield from _within(kind)


# --- type hash --------------------------------------------------------------------
#
# The hash of a ROS message type, which endpoints announce (REP-2011, REP-2016).

_HASH, _GATE = "typehash", "iveggate"
"""Keys of USER_DATA; ROS 2 reads letters and digits alone as one."""


@cache
def type_hash(message: type[Message]) -> str:
    """``RIHS01_`` and 64 hexadecimal digits."""
    return str(store_of(message).hash_rihs01(message.ROS))


def user_data(message: type[Message], gate: str = "") -> bytes:
    """USER_DATA of an endpoint, as ROS 2 writes it since Iron.

    Args:
        message: Its type.
        gate: Id of the robot whose gate has the endpoint, which is told beside.
    """
    mark = f"{_GATE}={gate};" if gate else ""
    return f"{_HASH}={type_hash(message)};{mark}".encode()


def read_user_data(data: bytes) -> tuple[str, str]:
    """Type hash and gate in an endpoint's USER_DATA; empty where it has none."""
    words = data.decode("utf-8", "replace").strip("\0").split(";")
    values = dict(word.split("=", 1) for word in words if "=" in word)
    return values.get(_HASH, ""), values.get(_GATE, "")
