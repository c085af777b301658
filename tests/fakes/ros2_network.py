"""A network of ROS 2 in memory: what was published on it, and what waits to be read."""

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

from iveg.ros2 import cdr
from iveg.ros2.messages import Message
from iveg.ros2.names import DEFAULT, Endpoint, Qos


def endpoint(
    topic: str,
    kind: type[Message],
    *,
    writes: bool = True,
    qos: Qos = DEFAULT,
    own: bool = False,
) -> Endpoint:
    """Somebody else's writer, unless ``own``."""
    return Endpoint(topic, kind.ROS, writes, qos, own)


@dataclass
class Reader:
    """A subscription."""

    waiting: list[bytes] = field(default_factory=list)

    def take(self) -> list[bytes]:
        found, self.waiting = self.waiting, []
        return found


@dataclass
class Writer:
    """A publication."""

    kind: type[Message]
    sent: list[bytes] = field(default_factory=list)
    readers: int = 1

    def write(self, payload: bytes) -> None:
        self.sent.append(payload)

    def said(self) -> list[Any]:
        """What was published."""
        return [cdr.read(self.kind, one) for one in self.sent]


class FakeNetwork:
    """Keeps everything by topic."""

    def __init__(self) -> None:
        self.readers: dict[str, Reader] = defaultdict(Reader)
        self.writers: dict[str, Writer] = {}
        self.others: list[Endpoint] = []
        self.asked: dict[str, tuple[type[Message], Qos]] = {}

    def reader(self, name: str, message: type[Message], qos: Qos) -> Reader:
        self.asked[name] = message, qos
        return self.readers[name]

    def writer(self, name: str, message: type[Message], qos: Qos) -> Writer:
        self.asked[name] = message, qos
        return self.writers.setdefault(name, Writer(message))

    def endpoints(self) -> list[Endpoint]:
        return self.others

    def publish(self, topic: str, message: Message, times: int = 1) -> None:
        """Somebody else publishes, and stays."""
        writer = endpoint(topic, type(message))
        if writer not in self.others:
            self.others.append(writer)
        self.readers[topic].waiting += [cdr.write(message)] * times
