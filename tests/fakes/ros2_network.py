"""A network of ROS 2 in memory: what was published on it, and what waits to be read."""

from collections import defaultdict
from collections.abc import Callable
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
    writers: int = 1

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
        self.deaf_on: list[str] = []
        self.raw: set[str] = set()
        self.asked: dict[str, tuple[type[Message], Qos]] = {}
        self._watched: list[tuple[list[Any], Callable[[], None]]] = []

    def reader(
        self, name: str, message: type[Message], qos: Qos, *, raw: bool = False
    ) -> Reader:
        self.asked[name] = message, qos
        if raw:
            self.raw.add(name)
        return self.readers[name]

    def writer(self, name: str, message: type[Message], qos: Qos) -> Writer:
        self.asked[name] = message, qos
        return self.writers.setdefault(name, Writer(message))

    def endpoints(self) -> list[Endpoint]:
        return self.others

    def unheard(self) -> list[str]:
        return self.deaf_on

    def watch(self, readers: list[Any], on_data: Callable[[], None]) -> None:
        self._watched.append((readers, on_data))

    def publish(self, topic: str, message: Message, times: int = 1) -> None:
        """Somebody else publishes."""
        arrived = cdr.write(message)
        self.readers[topic].waiting += [arrived] * times
        for readers, on_data in self._watched:
            if self.readers[topic] in readers:
                on_data()
