"""Times of each message, read at the broker and at Orion by a recorder of our own.

iVeg reads the broker every few hundredths of a second and skips old messages; Orion's
copy often comes first.  Here every message is read at once, from the agent's own topics
and by separate subscriptions at Orion, and decoded when the run is over.
"""

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Final

from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from iveg.adapters import clock
from iveg.adapters.orion import SUBSCRIPTIONS, OrionClient
from iveg.adapters.reconciler import (
    ALL_ROBOTS,
    WantedSubscription,
    write_subscription,
)
from iveg.cli.nodes import broker_of
from iveg.domain.clock_offset import LONGEST_S, STAMP_S
from iveg.domain.errors import HopError, UnreadableError
from iveg.domain.kinds import MEASURED
from iveg.domain.latency import DATA, DATA_OF, Data, Segment
from iveg.domain.observations import kind_of
from iveg.lab.embedded.server import http_server
from iveg.ngsi import codec, names
from iveg.settings import Settings

COUNTS: Final = ("sent", "lost", "orion_first")
HOPS: Final[tuple[Segment, ...]] = ("uplink", "fiware", "robot_orion")


@dataclass(frozen=True, slots=True)
class MessageTimes:
    """Times of one message at the places on its way, all by one clock (Unix s).

    Times of the same message are equal.

    Attributes:
        stamp: The robot's stamp; None: there is none.
        broker: Time at which the broker passed it on.
        orion: Time at which Orion's notification came; None: it never came.
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

        A stamp later than the message, or a minute before it, does not count.
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
"""Description of its subscriptions, which iVeg does not take for its own."""
LAST_COPIES_S: Final = 2.0
"""Wait for Orion's copies of the last messages (s)."""
_SUBSCRIBED_WITHIN_S = 5.0
_HOST = "127.0.0.1"


class MessageRecorder:
    """Messages with their times; they are decoded after the run."""

    def __init__(self) -> None:
        # Jumps of the wall clock must not come between two readings.
        self._since = clock.wall() - clock.mono()
        self._published: list[tuple[float, str, bytes]] = []
        self._notified: list[tuple[float, bytes]] = []

    def take_publication(self, topic: str, payload: bytes) -> None:
        """Note a message that the broker has passed on."""
        self._published.append((self._since + clock.mono(), topic, payload))

    def take_notification(self, body: bytes) -> None:
        """Note a notification that Orion has posted."""
        self._notified.append((self._since + clock.mono(), body))

    def times(self, begin: float, end: float) -> list[MessageTimes]:
        """Messages that were at the broker within a time (Unix s), in that order."""
        known: dict[MessageTimes, MessageTimes] = {}
        for at, topic, payload in self._published:
            if begin <= at < end:
                read = codec.read_measure(topic.split("/")[2], payload)
                for message in _messages_in(read):
                    known.setdefault(message, replace(message, broker=at))
        for at, body in self._notified:
            with contextlib.suppress(UnreadableError):
                for message in _messages_in(codec.read_notification(body)[1]):
                    earlier = known.get(message)
                    if earlier is not None and earlier.orion is None:
                        known[message] = replace(earlier, orion=at)
        return list(known.values())


def _messages_in(read: codec.ReadResult) -> Iterator[MessageTimes]:
    """The counted messages of a reading, without their times."""
    for observation in read.observations:
        data, origin = DATA_OF.get(kind_of(observation)), observation.origin
        if data is not None and origin.boot is not None and origin.seq is not None:
            robot_id: str = observation.robot_id
            yield MessageTimes(robot_id, data, origin.boot, origin.seq, origin.stamp_s)


# --- recording ------------------------------------------------------------------------


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
        http_server(_listener(recorded), _HOST, 0) as port,
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
                await orion.delete(f"{SUBSCRIPTIONS}/{subscription_id}")


def _listener(recorded: MessageRecorder) -> Starlette:
    """Application that takes notifications."""

    async def take(request: Request) -> Response:
        recorded.take_notification(await request.body())
        return Response(status_code=204)

    return Starlette(routes=[Route("/", take, methods=["POST"])])


def _subscriptions(url: str) -> Iterator[dict[str, object]]:
    """One for each kind of data: each notification has one message."""
    for kind in MEASURED:
        if kind.type_ in DATA_OF:
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

    So a message has its time at once, even while Orion's copies wait for the loop.
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
