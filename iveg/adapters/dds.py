"""DDS, the network of ROS 2: a participant and the endpoints on its domain.

Uses Eclipse Cyclone DDS, an optional extra (``iveg[ros2]``); nothing but this module
and ``dds_entities``, ``dds_types`` and ``dds_watch`` imports it.
Payloads stay bytes here: DDS checks them against the type, and ``iveg.ros2.cdr`` reads
the few that are wanted.  None of Cyclone's threads calls iVeg; one thread of ours waits
for messages that must be answered at once and wakes the event loop.
"""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from types import TracebackType

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
    DcpsEndpoint,
)
from cyclonedds.core import DDSException, InstanceState
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.qos import Qos as DdsQos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from iveg.adapters.dds_entities import MOST_TAKEN, DdsReader, DdsWriter
from iveg.adapters.dds_network import DdsNetwork
from iveg.adapters.dds_types import announced, read_qos, user_data_of, write_qos
from iveg.adapters.dds_watch import DdsWatch
from iveg.domain.errors import HopError
from iveg.ros2.names import Endpoint, Qos, dds_topic, ros_topic, ros_type
from iveg.ros2.schema import Message
from iveg.ros2.type_hash import user_data


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
        self._watches: list[DdsWatch] = []
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
        self._watches.append(DdsWatch(self._participant, readers, loop, on_data))

    # --- endpoints of others ------------------------------------------------------

    def endpoints(self) -> tuple[Endpoint, ...]:
        """All ROS writers and readers on the domain, this participant's among them."""
        for reader, writes in self._discovery:
            for sample in reader.take(MOST_TAKEN):
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
