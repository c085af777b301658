"""ROS bags as files: their topics, and their messages as plain CDR.

Reads ``.db3`` and ``.mcap`` files, directories of ROS 2 and ``.bag`` files of ROS 1
through rosbags.  Messages of ROS 1 are converted; that knows those types alone whose
definition ROS 2 has kept.
"""

from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from iveg.adapters.extras import require_extra
from iveg.domain.errors import DataFileError

if TYPE_CHECKING:  # an extra: iveg[bags]
    from rosbags.interfaces import Connection
    from rosbags.rosbag1 import Reader as Ros1Reader
    from rosbags.rosbag2 import Reader as Ros2Reader


@dataclass(frozen=True, slots=True)
class BagTopic:
    """One topic of a bag, in one type.

    Attributes:
        count: Number of messages.
        type_hash: ``RIHS01_…``; empty where the recorder wrote none.
        definition: As recorded, with the types within; empty where there is none.
    """

    name: str
    type: str
    count: int
    type_hash: str = ""
    definition: str = ""


@dataclass(frozen=True, slots=True)
class BagMessage:
    """One message.

    Attributes:
        logged_s: When the recorder wrote it (Unix s).
        payload: Plain CDR; empty where a message of ROS 1 is none of its type.
    """

    topic: str
    logged_s: float
    payload: bytes


class BagFile:
    """A bag, read from its start as often as asked, never held whole.

    Args:
        path: A file ``.db3``, ``.mcap`` or ``.bag``, or a directory of ROS 2.

    Raises:
        DataFileError: it cannot be read.
        MissingExtraError: rosbags is not installed.
    """

    def __init__(self, path: Path) -> None:
        require_extra("bags", str(path))
        from rosbags.typesys import Stores, get_typestore

        self.path = path
        self.is_ros1 = path.suffix == ".bag" and not path.is_dir()
        self._store = get_typestore(Stores.ROS2_HUMBLE)
        with self._open() as reader:
            found = {(one.topic, one.msgtype): one for one in reader.connections}
            counts = dict.fromkeys(found, 0)
            for one in reader.connections:
                counts[one.topic, one.msgtype] += one.msgcount
        self.topics = tuple(
            _topic(one, counts[key]) for key, one in sorted(found.items())
        )

    def messages(self, topics: Collection[BagTopic]) -> Iterator[BagMessage]:
        """Messages of these topics in the order in which they were recorded.

        Raises:
            DataFileError: the recording breaks off.
        """
        wanted = {(one.name, one.type) for one in topics}
        with self._open() as reader:
            connections = [
                one for one in reader.connections if (one.topic, one.msgtype) in wanted
            ]
            records = reader.messages(connections=connections) if connections else ()
            source = iter(records)
            while True:
                try:
                    connection, logged, data = next(source)
                except StopIteration:
                    return
                except Exception as error:  # whatever a damaged file provokes
                    raise self._unreadable(error) from error
                payload = self._payload(connection.msgtype, bytes(data))
                yield BagMessage(connection.topic, logged / 1e9, payload)

    def _payload(self, kind: str, data: bytes) -> bytes:
        if not self.is_ros1:
            return data
        try:
            return bytes(self._store.ros1_to_cdr(data, kind))
        except Exception:
            return b""

    @contextmanager
    def _open(self) -> "Iterator[Ros1Reader | Ros2Reader]":
        from rosbags.rosbag1 import Reader as Ros1Reader
        from rosbags.rosbag2 import Reader as Ros2Reader

        reader: Ros1Reader | Ros2Reader
        with ExitStack() as stack:
            try:
                reader = (
                    Ros1Reader(self.path) if self.is_ros1 else Ros2Reader(self.path)
                )
                stack.enter_context(reader)
            except Exception as error:  # whatever a foreign file provokes
                raise self._unreadable(error) from error
            yield reader

    def unusable(self, reason: str) -> DataFileError:
        """The error that this bag cannot be used; ``reason`` without its full stop."""
        return DataFileError(str(self.path), "", f"{reason}.")

    def _unreadable(self, error: Exception) -> DataFileError:
        said = " ".join(str(error).split()) or type(error).__name__
        return self.unusable(f"cannot be read: {said.rstrip('.')}")


def _topic(one: "Connection", count: int) -> BagTopic:
    digest = one.digest if one.digest.startswith("RIHS01_") else ""
    return BagTopic(one.topic, one.msgtype, count, digest, one.msgdef.data)
