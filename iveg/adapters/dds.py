"""DDS, the network of ROS 2: a participant and the endpoints on its domain.

Uses Eclipse Cyclone DDS, an optional extra (``iveg[ros2]``), which only this module
imports.  Payloads stay bytes here: DDS checks them against the type, and
``iveg.ros2.cdr`` reads the few that are needed.  None of Cyclone's threads calls iVeg:
readers are polled.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from typing import Any, Generic, TypeVar

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
    """The type that DDS announces for a message, with its nested types.

    Its samples stay bytes: Cyclone's reader and writer call the type to deserialize
    and serialize them.  A base class of ours would be announced with it.
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
        type_ = cls()
        type_.payload = data
        return type_

    _, fields = STORE.fielddefs[ros]
    members = {name: idl(kind) for name, kind in fields}
    typename, name = dds_type(ros).replace("::", "."), ros.rpartition("/")[2]
    kind: type[IdlStruct] = make_idl_struct(name, typename, members, dataclassify=False)
    kind.deserialize = classmethod(deserialize)
    kind.deserialize_key = classmethod(deserialize)
    kind.serialize = lambda sample, **_: sample.payload
    return kind


def write_qos(qos: Qos) -> DdsQos:
    """A quality of service as Cyclone's, with the policies that ROS 2 adds to each."""
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
        # A late reader gets as many samples as an early one could have kept.
        Policy.DurabilityService(0, history, -1, -1, -1),
        # ROS 2 sends and takes plain CDR of version 1.
        Policy.DataRepresentation(use_cdrv0_representation=True),
        # ROS 2 endpoints name the members of a type freely, or give no type.
        Policy.TypeConsistency.AllowTypeCoercion(ignore_member_names=True),
    )


def read_qos(qos: DdsQos) -> Qos:
    """The quality of service that another program announces, as ours."""
    return Qos(
        isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable),
        qos[Policy.Durability] != Policy.Durability.Volatile,
        getattr(qos[Policy.History], "depth", 0),
    )


# --- endpoints ----------------------------------------------------------------------
#
# A subscription and a publication of DDS: raw payloads in and out.

MOST_TAKEN = 200


@contextmanager
def _dds_errors() -> Iterator[None]:
    """Raise a refusal of DDS as HopError; around a block or a function."""
    try:
        yield
    except DDSException as error:
        raise HopError("dds", error.msg) from error


def _count(matched: Callable[[], list[int]]) -> int:
    """Number of matched endpoints of other programs."""
    # Cyclone's Python raises IndexError where an endpoint joins during the call.
    try:
        with _dds_errors():
            return len(matched())
    except IndexError:
        return _count(matched)


_Entity = TypeVar("_Entity", DataReader, DataWriter)


class _Endpoint(Generic[_Entity]):
    """Own endpoint, until it is closed."""

    def __init__(self, entity: _Entity) -> None:
        self._entity: _Entity | None = entity

    @property
    def entity(self) -> _Entity:
        """Cyclone's entity.

        Raises:
            HopError: the endpoint is closed.
        """
        if self._entity is None:
            raise HopError("dds", "closed")
        return self._entity

    def close(self) -> None:
        """Drop Cyclone's entity, which ends with its last reference."""
        self._entity = None


class DdsReader(_Endpoint[DataReader]):
    """A subscription."""

    def __init__(self, reader: DataReader, depth: int) -> None:
        super().__init__(reader)
        self._depth = depth

    @_dds_errors()
    def take(self) -> list[bytes]:
        """Every waiting message, oldest first.

        Raises:
            HopError: DDS refuses.
        """
        samples = self.entity.take(self._depth)
        return [sample.payload for sample in samples if sample.sample_info.valid_data]

    @property
    def writers(self) -> int:
        """Number of writers that serve it."""
        return _count(self.entity.get_matched_publications)


class DdsWriter(_Endpoint[DataWriter]):
    """A publication."""

    def __init__(self, writer: DataWriter, topic: Topic) -> None:
        super().__init__(writer)
        self._kind: type[IdlStruct] = topic.data_type

    @_dds_errors()
    def write(self, payload: bytes) -> None:
        """Send a message with its encapsulation.

        Raises:
            HopError: DDS refuses, or closed.
        """
        self.entity.write(self._kind.deserialize(payload))

    @property
    def readers(self) -> int:
        """Number of readers that it serves."""
        return _count(self.entity.get_matched_subscriptions)


# --- a participant ------------------------------------------------------------------

_FATAL = 1
"""The only category of its log that Cyclone still writes, once it runs."""


class Dds(AbstractContextManager["Dds"]):
    """One participant of a domain; use it with ``with``.

    Args:
        network: Domain, interface and peers.
        gate: Id of the robot whose gate this is; every endpoint carries it.

    Raises:
        HopError: no participant can be made on the network.
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
        # A peer that is switched off makes a hundred lines of log in two seconds.
        load_cyclonedds().dds_set_log_mask(_FATAL)
        self._guid = str(self._participant.guid)
        self._discovery = [
            (BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication), True),
            (BuiltinDataReader(self._participant, BuiltinTopicDcpsSubscription), False),
        ]

    def __exit__(self, *_: object) -> None:
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
        topic, policies = self._announced(name, message, qos)
        reader = DdsReader(DataReader(self._participant, topic, policies), qos.depth)
        self._own.append(reader)
        return reader

    def writer(self, name: str, message: type[Message], qos: Qos) -> DdsWriter:
        """Publish on a topic by its full ROS name."""
        topic, policies = self._announced(name, message, qos)
        writer = DdsWriter(DataWriter(self._participant, topic, policies), topic)
        self._own.append(writer)
        return writer

    def _announced(
        self, name: str, message: type[Message], qos: Qos
    ) -> tuple[Topic, DdsQos]:
        """Topic and policies of an endpoint."""
        kind = announced(message.ROS)
        if (name, kind) not in self._topics:
            self._topics[name, kind] = Topic(self._participant, dds_topic(name), kind)
        data = Policy.Userdata(user_data(message, self._gate))
        return self._topics[name, kind], DdsQos(data, base=write_qos(qos))

    # --- endpoints of others ------------------------------------------------------

    def endpoints(self) -> tuple[Endpoint, ...]:
        """All ROS writers and readers on the domain, with this participant's own.

        Endpoints that came and went since the last call are listed once.
        """
        ended: list[Endpoint] = []
        for reader, writes in self._discovery:
            for sample in reader.take(MOST_TAKEN):
                key, endpoint = str(sample.key), self._endpoint(sample, writes)
                known = self._endpoints.pop(key, None)
                if endpoint is None:
                    continue
                if sample.sample_info.instance_state == InstanceState.Alive:
                    self._endpoints[key] = endpoint
                elif known is None:
                    ended.append(endpoint)
        return *self._endpoints.values(), *ended

    def _endpoint(self, sample: DcpsEndpoint, writes: bool) -> Endpoint | None:
        # An invalid sample reports the end of an endpoint, without its topic.
        topic = ros_topic(sample.topic_name or "")
        if topic is None:
            return None
        policy = sample.qos[Policy.Userdata]
        return Endpoint(
            topic,
            ros_type(sample.type_name),
            writes,
            read_qos(sample.qos),
            str(sample.participant_key) == self._guid,
            # Type hash and gate; empty where it has none.
            *read_user_data(b"" if policy is None else bytes(policy.data)),
        )


# --- Cyclone's side ----------------------------------------------------------------

_configured: dict[int, tuple[str, Domain]] = {}
"""Configuration of each domain, which Cyclone takes at the first participant alone."""


def _configure(network: DdsNetwork) -> None:
    config = network.config()
    if network.domain not in _configured:
        _configured[network.domain] = config, Domain(network.domain, config)
    known, _ = _configured[network.domain]
    if known != config:
        raise HopError("dds", f"domain {network.domain} is configured otherwise")
