"""Plain CDR, the bytes of a ROS 2 message, by rosbags; either byte order is read.

Arrays that are read are views of the payload; sequences are lists.
"""

from functools import cache
from typing import Any

from rosbags.serde import SerdeError

from iveg.domain.errors import UnreadableError
from iveg.ros2.messages import STORE, Message


def read(message: type[Message], payload: bytes) -> Any:
    """Read one message, with up to three bytes of padding behind it.

    Args:
        message: Its type.
        payload: Its bytes with their encapsulation.

    Raises:
        UnreadableError: bytes that this type does not describe.
    """
    try:
        return STORE.deserialize_cdr(memoryview(payload), message.ROS)
    except SerdeError as error:
        size = f"{message.ROS} of {len(payload)} bytes"
        raise UnreadableError("unreadable", size) from error


def write(message: Message) -> bytes:
    """Little-endian bytes of one message, with their encapsulation."""
    return bytes(STORE.serialize_cdr(message, message.ROS, little_endian=True))


# --- type hash --------------------------------------------------------------------
#
# The hash of a ROS message type, which endpoints announce (REP-2011, REP-2016).

_HASH, _GATE = "typehash", "iveggate"
"""Keys of USER_DATA; ROS 2 takes keys of letters and digits only."""


@cache
def type_hash(message: type[Message]) -> str:
    """``RIHS01_`` and 64 hexadecimal digits."""
    return str(STORE.hash_rihs01(message.ROS))


def user_data(message: type[Message], gate: str = "") -> bytes:
    """USER_DATA of an endpoint, as ROS 2 writes it since Iron.

    Args:
        message: Its type.
        gate: Id of the robot whose gate has the endpoint; empty: no gate of iVeg.
    """
    mark = f"{_GATE}={gate};" if gate else ""
    return f"{_HASH}={type_hash(message)};{mark}".encode()


def read_user_data(data: bytes) -> tuple[str, str]:
    """Type hash and gate in an endpoint's USER_DATA; empty where it has none."""
    words = data.decode("utf-8", "replace").strip("\0").split(";")
    values = dict(word.split("=", 1) for word in words if "=" in word)
    return values.get(_HASH, ""), values.get(_GATE, "")
