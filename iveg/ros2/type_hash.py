"""The hash of a ROS message type, which endpoints announce, and its definition as text.

Source: REP-2011 ("Evolving Message Types"), REP-2016 and the README of
``rosidl_generator_type_description``: SHA-256 over the canonical JSON of the type and
of all types within it, without default values; ``RIHS01`` is version 1 of the standard.
"""

import hashlib
import json
from collections.abc import Iterator
from functools import cache

from iveg.ros2.schema import Kind, Many, Message, One, Structure, fields_of

_NESTED, _STRING = 1, 17
_TYPE_IDS = {
    "int8": 2,
    "uint8": 3,
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "float32": 10,
    "float64": 11,
    "boolean": 15,
}
_ARRAY, _SEQUENCE = 48, 144
"""Added to the id of what there are many of."""
_HASH, _GATE = "typehash", "iveggate"
"""Keys of USER_DATA; ROS 2 reads letters and digits alone as one."""


@cache
def type_hash(message: type[Message]) -> str:
    """``RIHS01_`` and 64 hexadecimal digits."""
    described = {
        "type_description": _described(message),
        "referenced_type_descriptions": [
            _described(one)
            for one in sorted(set(_within(message)), key=lambda one: one.ROS)
        ],
    }
    digest = hashlib.sha256(json.dumps(described).encode()).hexdigest()
    return f"RIHS01_{digest}"


def user_data(message: type[Message], gate: str = "") -> bytes:
    """What ROS 2 since Iron writes into USER_DATA of each endpoint.

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


def definition(message: type[Message]) -> str:
    """Fields of a type in one line, as its ``.msg`` file has them."""
    return ", ".join(f"{_word(kind)} {name}" for name, kind in fields_of(message))


def _within(message: type[Message]) -> Iterator[type[Message]]:
    for _, kind in fields_of(message):
        if isinstance(kind, Structure):
            yield kind.message
            yield from _within(kind.message)


def _described(message: type[Message]) -> dict[str, object]:
    fields = [
        {"name": name, "type": _field_type(kind)} for name, kind in fields_of(message)
    ]
    return {"type_name": message.ROS, "fields": fields}


def _field_type(kind: Kind) -> dict[str, object]:
    number, capacity, nested = _STRING, 0, ""
    match kind:
        case One(primitive):
            number = _TYPE_IDS[primitive]
        case Many(primitive, count):
            capacity = count or 0
            number = _TYPE_IDS[primitive] + (_SEQUENCE if count is None else _ARRAY)
        case Structure(message, many):
            nested = message.ROS
            number = _NESTED + (_SEQUENCE if many else 0)
    return {
        "type_id": number,
        "capacity": capacity,
        "string_capacity": 0,
        "nested_type_name": nested,
    }


def _word(kind: Kind) -> str:
    match kind:
        case One(primitive):
            return "bool" if primitive == "boolean" else primitive
        case Many(primitive, count):
            return f"{primitive}[{'' if count is None else count}]"
        case Structure(message, many):
            return message.ROS.replace("/msg/", "/") + ("[]" if many else "")
        case _:
            return "string"
