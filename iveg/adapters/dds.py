"""DDS, the network of ROS 2: a participant and the endpoints on its domain.

Uses Eclipse Cyclone DDS, an optional extra (``iveg[ros2]``), which nothing but this
module imports.
Payloads stay bytes here: DDS checks them against the type, and ``iveg.ros2.cdr`` reads
the few that are wanted.  None of Cyclone's threads calls iVeg: readers are polled.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache
from types import TracebackType
from typing import Any

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
    DcpsEndpoint,
)
from cyclonedds.core import (
    DDSException,
    InstanceState,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct, types
from cyclonedds.internal import load_cyclonedds
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.qos import Qos as DdsQos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.interfaces import Nodetype

from iveg.adapters.dds_network import DdsNetwork
from iveg.domain.errors import HopError
from iveg.ros2.cdr import read_user_data, user_data
from iveg.ros2.messages import STORE, Message
from iveg.ros2.names import Endpoint, Qos, dds_topic, dds_type, ros_topic, ros_type

# --- types and qualities of service ------------------------------------------------
#
# Types and qualities of service of ROS 2 in the words of Cyclone DDS.

_PLAIN = {"bool": bool, "string": str}


@cache
def announced(ros: str) -> type[IdlStruct]:
    """The type that DDS announces for a message, with all within it.

    Its samples stay bytes: Cyclone's reader and writer ask a type to deserialize and
    serialize them, and a base of ours would be announced with it.
    """

    def idl(kind: Any) -> Any:
        match kind:
            case (Nodetype.NAME, nested):
                return announced(nested)
            case (Nodetype.SEQUENCE, (inner, _)):
                return types.sequence[idl(inner)]
            case (Nodetype.ARRAY, (inner, count)):
                return types.array[idl(inner), count]
            case (_, (name, _)):
                return _PLAIN.get(name) or getattr(types, name)

    def deserialize(cls: type[IdlStruct], data: bytes, /, **_: object) -> IdlStruct:
        made = cls()
        made.payload = data
        return made

    _, fields = STORE.fielddefs[ros]
    members = {name: idl(kind) for name, kind in fields}
    typename, name = dds_type(ros).replace("::", "."), ros.rpartition("/")[2]
    kind: type[IdlStruct] = make_idl_struct(name, typename, members, dataclassify=False)
    kind.deserialize = classmethod(deserialize)
    kind.deserialize_key = classmethod(deserialize)
    kind.serialize = lambda sample, **_: sample.payload
    return kind


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
    """Type hash and gate in an endpoint's user data; empty where it has none."""
    policy = qos[Policy.Userdata]
    return read_user_data(b"" if policy is None else bytes(policy.data))


# --- endpoints ----------------------------------------------------------------------
#
# A subscription and a publication of DDS: raw payloads in and out.

MOST_TAKEN = 200


def _count(matched: Callable[[], list[int]]) -> int:
    """Number of the other side's; Cyclone's Python fails where one joins meanwhile."""
    try:
        return len(matched())
    except IndexError:
        return _count(matched)
    except DDSException as error:
        raise HopError("dds", error.msg) from error


class DdsReader:
    """A subscription."""

    def __init__(self, reader: DataReader, depth: int) -> None:
        self._reader: DataReader | None = reader
        self._depth = depth

    def take(self) -> list[bytes]:
        """Every waiting message, oldest first.

        Raises:
            HopError: DDS refuses.
        """
        try:
            found = self.entity.take(self._depth)
        except DDSException as error:
            raise HopError("dds", error.msg) from error
        return [sample.payload for sample in found if sample.sample_info.valid_data]

    @property
    def entity(self) -> DataReader:
        """Cyclone's.

        Raises:
            HopError: closed.
        """
        if self._reader is None:
            raise HopError("dds", "closed")
        return self._reader

    @property
    def writers(self) -> int:
        """Number of writers that serve it."""
        return _count(self.entity.get_matched_publications)

    def close(self) -> None:
        """Let go of Cyclone's entity."""
        self._reader = None


class DdsWriter:
    """A publication."""

    def __init__(self, writer: DataWriter, topic: Topic) -> None:
        self._writer: DataWriter | None = writer
        self._kind: type[IdlStruct] = topic.data_type

    def write(self, payload: bytes) -> None:
        """Send a message with its encapsulation.

        Raises:
            HopError: DDS refuses, or closed.
        """
        try:
            self._entity.write(self._kind.deserialize(payload))
        except DDSException as error:
            raise HopError("dds", error.msg) from error

    @property
    def _entity(self) -> DataWriter:
        if self._writer is None:
            raise HopError("dds", "closed")
        return self._writer

    @property
    def readers(self) -> int:
        """Number of readers that it serves."""
        return _count(self._entity.get_matched_subscriptions)

    def close(self) -> None:
        """Let go of Cyclone's entity."""
        self._writer = None


# --- a participant ------------------------------------------------------------------

_FATAL = 1
"""The only category of its log that Cyclone still writes, once it runs."""


class Dds(AbstractContextManager["Dds"]):
    """One participant of a domain; use it with ``with``.

    Args:
        network: Where.
        gate: Id of the robot whose gate it is; every endpoint carries it.

    Raises:
        HopError: no participant can be made there.
    """

    def __init__(self, network: DdsNetwork, gate: str = "") -> None:
        self._gate = gate
        self._topics: dict[tuple[str, type], Topic] = {}
        self._own: list[DdsReader | DdsWriter] = []
        self._endpoints: dict[str, Endpoint] = {}
        try:
            _configure(network)
            self._participant = DomainParticipant(network.domain)
        except DDSException as error:
            detail = f"no participant on domain {network.domain}: {error.msg}"
            raise HopError("dds", detail) from error
        # A peer that is switched off fails a hundred times in two seconds, each a line.
        load_cyclonedds().dds_set_log_mask(_FATAL)
        self._guid = str(self._participant.guid)
        self._discovery = [
            (BuiltinDataReader(self._participant, topic), writes)
            for topic, writes in (
                (BuiltinTopicDcpsPublication, True),
                (BuiltinTopicDcpsSubscription, False),
            )
        ]

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave; nothing is called afterwards."""
        # Cyclone deletes an entity with its last reference, the participant last.
        for endpoint in self._own:
            endpoint.close()
        self._own.clear()
        self._topics.clear()
        self._discovery.clear()
        del self._participant

    # --- endpoints of ours --------------------------------------------------------

    def reader(self, name: str, message: type[Message], qos: Qos) -> DdsReader:
        """Subscribe to a topic by its full ROS name."""
        policies = self._policies(message, qos)
        topic = self._topic(name, message)
        made = DdsReader(DataReader(self._participant, topic, policies), qos.depth)
        self._own.append(made)
        return made

    def writer(self, name: str, message: type[Message], qos: Qos) -> DdsWriter:
        """Publish on a topic by its full ROS name."""
        topic = self._topic(name, message)
        policies = self._policies(message, qos)
        made = DdsWriter(DataWriter(self._participant, topic, policies), topic)
        self._own.append(made)
        return made

    def _policies(self, message: type[Message], qos: Qos) -> DdsQos:
        data = Policy.Userdata(user_data(message, self._gate))
        return DdsQos(data, base=write_qos(qos))

    def _topic(self, name: str, message: type[Message]) -> Topic:
        kind = announced(message.ROS)
        if (name, kind) not in self._topics:
            made = Topic(self._participant, dds_topic(name), kind)
            self._topics[name, kind] = made
        return self._topics[name, kind]

    # --- endpoints of others ------------------------------------------------------

    def endpoints(self) -> tuple[Endpoint, ...]:
        """All ROS writers and readers on the domain, this participant's among them.

        Those that came and went since the last call are told once.
        """
        gone: list[Endpoint] = []
        for reader, writes in self._discovery:
            for sample in reader.take(MOST_TAKEN):
                key, found = str(sample.key), self._endpoint(sample, writes)
                known = self._endpoints.pop(key, None)
                if found is None:
                    continue
                if sample.sample_info.instance_state == InstanceState.Alive:
                    self._endpoints[key] = found
                elif known is None:
                    gone.append(found)
        return *self._endpoints.values(), *gone

    def _endpoint(self, sample: DcpsEndpoint, writes: bool) -> Endpoint | None:
        # An invalid sample tells the end of an endpoint and nothing about it.
        topic = ros_topic(sample.topic_name or "")
        if topic is None:
            return None
        return Endpoint(
            topic,
            ros_type(sample.type_name),
            writes,
            read_qos(sample.qos),
            str(sample.participant_key) == self._guid,
            *user_data_of(sample.qos),
        )


# --- Cyclone's side ----------------------------------------------------------------

_configured: dict[int, tuple[str, Domain]] = {}
"""Cyclone takes one configuration a domain and process, at its first participant."""


def _configure(network: DdsNetwork) -> None:
    config = network.config()
    if network.domain not in _configured:
        _configured[network.domain] = config, Domain(network.domain, config)
    known, _ = _configured[network.domain]
    if known != config:
        raise HopError("dds", f"domain {network.domain} is configured otherwise")
