"""Types and qualities of service of ROS 2 in the words of Cyclone DDS."""

from functools import cache

from cyclonedds.idl import IdlStruct, make_idl_struct, types
from cyclonedds.qos import Policy
from cyclonedds.qos import Qos as DdsQos
from cyclonedds.util import duration

from iveg.ros2.names import Qos, dds_type
from iveg.ros2.schema import Many, Message, One, Structure, Text, fields_of
from iveg.ros2.type_hash import read_user_data


def _leave_in_bytes(kind: type[IdlStruct]) -> None:
    """Let samples of a type of ours stay bytes: ``iveg.ros2.cdr`` reads them.

    Cyclone's reader and writer ask a type to deserialize and serialize its samples, and
    a base of ours would be announced with it.
    """

    def deserialize(cls: type[IdlStruct], data: bytes, /, **_: object) -> IdlStruct:
        made = cls()
        made.payload = data
        return made

    kind.deserialize = classmethod(deserialize)
    kind.deserialize_key = classmethod(deserialize)
    kind.serialize = lambda sample, **_: sample.payload


@cache
def announced(message: type[Message], *, decodes: bool = False) -> type[IdlStruct]:
    """The type that DDS announces for a message.

    Args:
        message: Ours.
        decodes: Cyclone's Python shall make and read its samples.
    """
    members = {name: _idl_type(kind, decodes) for name, kind in fields_of(message)}
    typename = dds_type(message.ROS).replace("::", ".")
    kind: type[IdlStruct] = make_idl_struct(
        message.__name__, typename, members, dataclassify=decodes
    )
    if not decodes:
        _leave_in_bytes(kind)
    return kind


def _idl_type(kind: One | Many | Text | Structure, decodes: bool) -> object:
    match kind:
        case One("boolean"):
            return bool
        case One(primitive):
            return getattr(types, primitive)
        case Many(primitive, None):
            return types.sequence[getattr(types, primitive)]
        case Many(primitive, count):
            return types.array[getattr(types, primitive), count]
        case Text():
            return str
        case Structure(message, many):
            nested = announced(message, decodes=decodes)
            return types.sequence[nested] if many else nested


def write_qos(qos: Qos) -> DdsQos:
    """A quality of service in Cyclone's words, and what ROS 2 adds to each."""
    reliability = (
        Policy.Reliability.Reliable(duration(milliseconds=100))
        if qos.reliable
        else Policy.Reliability.BestEffort
    )
    durability = (
        Policy.Durability.TransientLocal
        if qos.transient_local
        else Policy.Durability.Volatile
    )
    history = Policy.History.KeepLast(qos.depth)
    return DdsQos(
        reliability,
        durability,
        history,
        # A late reader gets as many as an early one could have kept.
        Policy.DurabilityService(0, history, -1, -1, -1),
        # ROS 2 sends and takes plain CDR of version 1.
        Policy.DataRepresentation(use_cdrv0_representation=True),
        # Its endpoints name the members of a type freely, or give no type.
        Policy.TypeConsistency.AllowTypeCoercion(ignore_member_names=True),
    )


def read_qos(qos: DdsQos) -> Qos:
    """The quality of service that another program announces, in our words."""
    history = qos[Policy.History]
    return Qos(
        isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable),
        qos[Policy.Durability] != Policy.Durability.Volatile,
        getattr(history, "depth", 0),
    )


def user_data_of(qos: DdsQos) -> tuple[str, str]:
    """What an endpoint says in its user data; empty where it says nothing."""
    policy = qos[Policy.Userdata]
    return read_user_data(b"" if policy is None else bytes(policy.data))
