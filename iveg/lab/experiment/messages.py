"""Times of each message, read at the broker and at Orion by a recorder of our own.

iVeg reads the broker every few hundredths of a second and skips what is old; Orion's
copy is often there before.  Here every message is read at once, from the agent's own
topics and by subscriptions of our own at Orion, and decoded when the run is over.
"""

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator, Iterable, Iterator
from dataclasses import dataclass, field, replace
from http import HTTPStatus
from typing import Final

from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion

from iveg.adapters import clock
from iveg.adapters.orion import OrionClient
from iveg.adapters.post_listener import post_listener
from iveg.adapters.reconciler import (
    ALL_ROBOTS,
    WantedSubscription,
    write_subscription,
)
from iveg.cli.nodes import broker_of
from iveg.domain.clock_offset import LONGEST_S, STAMP_S
from iveg.domain.errors import HopError, UnreadableError
from iveg.domain.kinds import MEASURED
from iveg.domain.latency import DATA, Data, Segment, data_of
from iveg.domain.observations import kind_of
from iveg.ngsi import codec, names
from iveg.settings import Settings

COUNTS: Final = ("sent", "lost", "orion_first")
HOPS: Final[tuple[Segment, ...]] = ("uplink", "fiware", "robot_orion")


@dataclass(frozen=True, slots=True)
class MessageTimes:
    """One message at the places that it passed, all by one clock (Unix s).

    Two are equal if they are of one message.

    Attributes:
        stamp: As the robot stamped it; None: it did not.
        broker: When the broker had passed it on.
        orion: When Orion's notification was here; None: it never came.
    """

    robot_id: str
    data: Data
    boot: str
    seq: int
    stamp: float | None = field(compare=False)
    broker: float = field(default=0.0, compare=False)
    orion: float | None = field(default=None, compare=False)

    @property
    def hops(self) -> dict[Segment, float] | None:
        """Δt₁, Δt₂ and their sum (s); None where Orion's copy was first or never came.

        What was stamped later than it came, or a minute before, does not count.
        """
        if self.stamp is None or self.orion is None:
            return None
        up, on = self.broker - self.stamp, self.orion - self.broker
        if on < 0.0 or not -STAMP_S <= up <= LONGEST_S:
            return None
        up = max(0.0, up)
        return {"uplink": up, "fiware": on, "robot_orion": up + on}


def counts_of(times: Iterable[MessageTimes]) -> dict[Data, dict[str, int]]:
    """Messages at the broker; of these lost, or first at Orion."""
    counts = {data: dict.fromkeys(COUNTS, 0) for data in DATA}
    for message in times:
        count = counts[message.data]
        count["sent"] += 1
        if message.orion is None:
            count["lost"] += 1
        else:
            count["orion_first"] += message.orion < message.broker
    return counts


def hops_of(times: Iterable[MessageTimes]) -> dict[Data, dict[Segment, list[float]]]:
    """Durations of each hop by kind of data (ms)."""
    took: dict[Data, dict[Segment, list[float]]] = {
        data: {hop: [] for hop in HOPS} for data in DATA
    }
    for message in times:
        for hop, duration in (message.hops or {}).items():
            took[message.data][hop].append(round(1000.0 * duration, 3))
    return took


DESCRIPTION: Final = "iVeg experiment, times of messages"
"""Description of its subscriptions; iVeg leaves alone those that begin otherwise."""
LAST_COPIES_S: Final = 2.0
"""Wait for Orion's copies of the last messages (s)."""
_SUBSCRIBED_WITHIN_S = 5.0
_HOST = "127.0.0.1"


class MessageRecorder:
    """Holds what was read, and when; decodes it when asked."""

    def __init__(self) -> None:
        # Steps of the wall clock must not get between two readings.
        self._since = clock.wall() - clock.mono()
        self._published: list[tuple[float, str, bytes]] = []
        self._notified: list[tuple[float, bytes]] = []

    def take_publication(self, topic: str, payload: bytes) -> None:
        """Note a message that the broker has passed on."""
        self._published.append((self._since + clock.mono(), topic, payload))

    def take_notification(self, body: bytes) -> tuple[HTTPStatus, str]:
        """Note a notification that Orion has posted."""
        self._notified.append((self._since + clock.mono(), body))
        return HTTPStatus.NO_CONTENT, ""

    def times(self, begin: float, end: float) -> list[MessageTimes]:
        """Messages that were at the broker within a time (Unix s), in that order."""
        found: dict[MessageTimes, MessageTimes] = {}
        for at, topic, payload in self._published:
            if begin <= at < end:
                read = codec.read_measure(topic.split("/")[2], payload)
                for message in _messages_in(read):
                    found.setdefault(message, replace(message, broker=at))
        for at, body in self._notified:
            with contextlib.suppress(UnreadableError):
                for message in _messages_in(codec.read_notification(body)[1]):
                    known = found.get(message)
                    if known is not None and known.orion is None:
                        found[message] = replace(known, orion=at)
        return list(found.values())


def _messages_in(read: codec.ReadResult) -> Iterator[MessageTimes]:
    """The messages of a reading that count themselves; times are not known yet."""
    for observation in read.observations:
        data, origin = data_of(kind_of(observation)), observation.origin
        if data is not None and origin.boot is not None and origin.seq is not None:
            robot_id: str = observation.robot_id
            yield MessageTimes(robot_id, data, origin.boot, origin.seq, origin.stamp_s)


# --- where it reads -------------------------------------------------------------------


@contextlib.asynccontextmanager
async def recorder(settings: Settings) -> AsyncIterator[MessageRecorder]:
    """Record while the block lasts.

    Raises:
        HopError: the broker or Orion does not take it.
    """
    recorded = MessageRecorder()
    tenant = settings.fiware_service, settings.fiware_servicepath
    async with (
        _reading(settings, recorded),
        post_listener(recorded.take_notification, _HOST) as port,
        OrionClient(settings.orion_url, *tenant) as orion,
    ):
        subscribed = [
            await orion.create_subscription(document)
            for document in _subscriptions(f"http://{_HOST}:{port}/")
        ]
        try:
            yield recorded
        finally:
            for subscription_id in subscribed:
                await orion.delete_subscription(subscription_id)


def _subscriptions(url: str) -> Iterator[dict[str, object]]:
    """One for each kind of data: each notification has one message."""
    for kind in MEASURED:
        if data_of(kind.of) is not None:
            attributes = tuple(name for name, _ in kind.attributes)
            wanted = WantedSubscription("", ALL_ROBOTS, attributes)
            yield {
                **write_subscription(wanted, url, "experiment"),
                "description": DESCRIPTION,
            }


@contextlib.asynccontextmanager
async def _reading(
    settings: Settings, recorded: MessageRecorder
) -> AsyncIterator[None]:
    """Read the agent's own topics at the broker, in a thread of its own.

    A message has its time as soon as it is read, before any of Orion's that wait.
    """
    address, stands = broker_of(settings), threading.Event()
    topic = names.measure_topic(settings.apikey, "+")

    def connected(client: paho.Client, *_: object) -> None:
        client.subscribe(topic)

    def arrived(_client: object, _data: object, message: paho.MQTTMessage) -> None:
        recorded.take_publication(message.topic, bytes(message.payload))

    client = paho.Client(CallbackAPIVersion.VERSION2)
    client.on_connect, client.on_message = connected, arrived
    client.on_subscribe = lambda *_: stands.set()
    try:
        await asyncio.to_thread(client.connect, address.host, address.port)
    except OSError as error:
        raise HopError("mqtt", str(error)) from error
    client.loop_start()
    try:
        if not await asyncio.to_thread(stands.wait, _SUBSCRIBED_WITHIN_S):
            raise HopError("mqtt", "takes no subscription to the robots' measures")
        yield
    finally:
        client.disconnect()
        await asyncio.to_thread(client.loop_stop)
