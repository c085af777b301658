"""A subscription and a publication of DDS: raw payloads in and out."""

from cyclonedds.core import DDSException
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from iveg.domain.errors import HopError

MOST_TAKEN = 200
_FEW = 8
"""Cyclone makes room for as many as are asked for, and mostly one waits."""


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
            found += self._take(MOST_TAKEN)
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
