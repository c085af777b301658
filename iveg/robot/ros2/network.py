"""The DDS network as a robot needs it: the port of ``iveg/adapters/dds.py``."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from iveg.ros2.names import Endpoint, Qos
from iveg.ros2.schema import Message


class Reader(Protocol):
    """A subscription."""

    def take(self) -> Sequence[bytes]:
        """All pending messages, oldest first."""


class Writer(Protocol):
    """A publication."""

    def write(self, payload: bytes) -> None:
        """Publish a message."""

    @property
    def readers(self) -> int:
        """Number of subscribers."""


class Network(Protocol):
    """One participant."""

    def reader(self, name: str, message: type[Message], qos: Qos) -> Reader:
        """Subscribe."""

    def writer(self, name: str, message: type[Message], qos: Qos) -> Writer:
        """Publish."""

    def endpoints(self) -> Sequence[Endpoint]:
        """All writers and readers on the network."""

    def watch(self, readers: list[Any], on_data: Callable[[], None]) -> None:
        """Call ``on_data`` soon after new data."""
