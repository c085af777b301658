"""DDS, the network of ROS 2: raw payloads in and out, and its endpoints.

Uses Eclipse Cyclone DDS, an optional extra (``iveg[ros2]``); nothing but this module
and ``dds_types`` imports it.
Payloads stay bytes here: DDS checks them against the type, and ``iveg.ros2.cdr`` reads
the few that are wanted.  None of Cyclone's threads calls iVeg; one thread of ours waits
for messages that must be answered at once and wakes the event loop.
"""

import asyncio
import threading
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from types import TracebackType

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
    DcpsEndpoint,
)
from cyclonedds.core import (
    DDSException,
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.qos import Qos as DdsQos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from iveg.adapters.dds_network import DdsNetwork
from iveg.adapters.dds_types import announced, read_qos, user_data_of, write_qos
from iveg.domain.errors import HopError
from iveg.ros2.names import Endpoint, Qos, dds_topic, ros_topic, ros_type
from iveg.ros2.schema import Message
from iveg.ros2.type_hash import user_data

_WAIT_MS = 250
_REARM_S = 0.002
_MOST_TAKEN = 200
_FEW = 8
"""Cyclone makes room for as many as are asked for, and mostly one waits."""


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
        self._watches: list[_Watch] = []
        self._topics: dict[tuple[str, str], Topic] = {}
        self._own: list[DdsReader | DdsWriter] = []
        self._endpoints: dict[str, Endpoint] = {}
        try:
            _configure(network)
            self._participant = DomainParticipant(network.domain)
        except DDSException as error:
            detail = f"no participant on domain {network.domain}: {error.msg}"
            raise HopError("dds", detail) from error
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
        for watch in self._watches:
            watch.stop()
        self._watches.clear()
        # Cyclone deletes an entity with its last reference, the participant last.
        for endpoint in self._own:
            endpoint.close()
        self._own.clear()
        self._topics.clear()
        self._discovery.clear()
        del self._participant

    # --- endpoints of ours --------------------------------------------------------

    def reader(self, name: str, message: type[Message], qos: Qos) -> "DdsReader":
        """Subscribe to a topic by its full ROS name."""
        policies = self._policies(message, qos)
        reader = DataReader(self._participant, self._topic(name, message), policies)
        made = DdsReader(reader)
        self._own.append(made)
        return made

    def writer(self, name: str, message: type[Message], qos: Qos) -> "DdsWriter":
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
        key = name, message.ROS
        if key not in self._topics:
            kind = announced(message)
            self._topics[key] = Topic(self._participant, dds_topic(name), kind)
        return self._topics[key]

    def watch(
        self, readers: Sequence["DdsReader"], on_data: Callable[[], None]
    ) -> None:
        """Call ``on_data`` in the running loop soon after any of these has news.

        It is called again 2 ms later at the earliest, however much comes.
        """
        loop = asyncio.get_running_loop()
        self._watches.append(_Watch(self._participant, readers, loop, on_data))

    # --- endpoints of others ------------------------------------------------------

    def endpoints(self) -> tuple[Endpoint, ...]:
        """All ROS writers and readers on the domain, this participant's among them."""
        for reader, writes in self._discovery:
            for sample in reader.take(_MOST_TAKEN):
                self._note(sample, writes)
        return tuple(self._endpoints.values())

    def _note(self, sample: DcpsEndpoint, writes: bool) -> None:
        key = str(sample.key)
        if sample.sample_info.instance_state != InstanceState.Alive:
            self._endpoints.pop(key, None)
            return
        topic = ros_topic(sample.topic_name)
        if topic is None:
            return
        self._endpoints[key] = Endpoint(
            topic,
            ros_type(sample.type_name),
            writes,
            read_qos(sample.qos),
            str(sample.participant_key) == self._guid,
            *user_data_of(sample.qos),
        )


class DdsReader:
    """A subscription."""

    def __init__(self, reader: DataReader) -> None:
        self._reader: DataReader | None = reader

    def take(self) -> list[bytes]:
        """Every waiting message, oldest first.

        Raises:
            HopError: DDS refuses.
        """
        found = self._take(_FEW)
        if len(found) == _FEW:
            found += self._take(_MOST_TAKEN)
        return [one.payload for one in found if one.sample_info.valid_data]

    def _take(self, most: int) -> list[IdlStruct]:
        try:
            found: list[IdlStruct] = self.entity.take(most)
        except DDSException as error:
            raise HopError("dds", error.msg) from error
        return found

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
        return len(self.entity.get_matched_publications())

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
        return len(self._entity.get_matched_subscriptions())

    def close(self) -> None:
        """Let go of Cyclone's entity."""
        self._writer = None


# --- Cyclone's side ----------------------------------------------------------------

_configured: dict[int, tuple[str, Domain]] = {}
"""Cyclone takes one configuration a domain and process, at its first participant."""


def _configure(network: DdsNetwork) -> None:
    config = network.config()
    known = _configured.get(network.domain)
    if known is None:
        _configured[network.domain] = config, Domain(network.domain, config)
    elif known[0] != config:
        raise HopError("dds", f"domain {network.domain} is configured otherwise")


class _Watch:
    """A thread that waits for data and wakes the loop, which takes them."""

    def __init__(
        self,
        participant: DomainParticipant,
        readers: Iterable[DdsReader],
        loop: asyncio.AbstractEventLoop,
        on_data: Callable[[], None],
    ) -> None:
        self._waitset = WaitSet(participant)
        mask = SampleState.NotRead | ViewState.Any | InstanceState.Any
        self._conditions = [ReadCondition(one.entity, mask) for one in readers]
        for condition in self._conditions:
            self._waitset.attach(condition)
        self._loop, self._on_data = loop, on_data
        self._ended = threading.Event()
        # Nobody lets go of it: to wait for it is the cheapest rest.
        self._rest = threading.Lock()
        self._rest.acquire()
        self._is_announced = False
        self._thread = threading.Thread(target=self._wait, name="dds", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._ended.set()
        self._thread.join()

    def _wait(self) -> None:
        while not self._ended.is_set():
            if not self._waitset.wait(duration(milliseconds=_WAIT_MS)):
                continue
            if not self._is_announced:
                self._is_announced = True
                try:
                    self._loop.call_soon_threadsafe(self._tell)
                except RuntimeError:  # the loop has closed
                    return
            # The loop takes what came meanwhile; a flood wakes it no more often.
            self._rest.acquire(timeout=_REARM_S)

    def _tell(self) -> None:
        # First, so that a sample which on_data just misses is announced again.
        self._is_announced = False
        if not self._ended.is_set():
            self._on_data()
