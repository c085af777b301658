"""MQTT: one connection that reconnects by itself.

``run`` connects, subscribes and hands every message on; when the broker goes it tries
again with a growing, jittered pause.  ``publish`` waits for the broker's confirmation
(QoS 1) and raises; ``enqueue`` keeps only the newest message of each topic, for
telemetry.
"""

import asyncio
import logging
import random
import socket
from collections import deque
from collections.abc import Callable, Iterable, Mapping

import aiomqtt

from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.log_filter import quiet
from iveg.adapters.mqtt_inbox import Arrived, Qos1Message
from iveg.adapters.mqtt_outbox import OutboxClient
from iveg.adapters.tls import FileState
from iveg.domain.errors import HopError

_log = logging.getLogger(__name__)
# aiomqtt's own: it complains of every message that finds no room or no confirmation.
quiet("mqtt")
NODELAY = [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)]
MOST_EARLY = 2000
"""Messages at QoS 1 that wait until all subscriptions stand; the oldest give way."""
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.2, 2.0
_KEEPALIVE_S = 5
_ANSWERED_WITHIN_S, _CONFIRMED_WITHIN_S = 5.0, 1.5


class MqttLink:
    """A connection to the broker that lives as long as ``run`` does.

    Args:
        address: The broker.
        name: Says in logs whose connection this is; ids stay random.
        subscriptions: Topic filter → QoS, asked for on every connect.
        on_message: Called in the loop with topic and payload; must not block.
        on_connect: Called after every (re)connect, subscriptions in place.
        on_loss: Called once when a connection is lost.
        on_passed_over: Called with a topic and how many of its messages were not
            handed over because newer ones had come with them; before the newest.
        apart_s: Least time between two readings (s); 0: whenever something comes.
        look_every_s: Between two looks for another certificate (s).
    """

    def __init__(
        self,
        address: BrokerAddress,
        name: str,
        subscriptions: Mapping[str, int] | None = None,
        on_message: Callable[[str, bytes], None] = lambda _topic, _payload: None,
        on_connect: Callable[[], None] = lambda: None,
        on_loss: Callable[[], None] = lambda: None,
        on_passed_over: Callable[[str, int], None] = lambda _topic, _count: None,
        apart_s: float = 0.0,
        look_every_s: float = 2.0,
    ) -> None:
        self._address = address
        self._name = name
        self._look_every_s = look_every_s
        self._apart_s = apart_s
        self.attach(
            subscriptions or {}, on_message, on_connect, on_loss, on_passed_over
        )
        self._client: OutboxClient | None = None
        self._offered: dict[str, tuple[bytes, int]] = {}
        self._early: deque[Qos1Message] = deque(maxlen=MOST_EARLY)
        """Came before all subscriptions were in place, when nothing can be answered."""
        self._wake, self._drained = asyncio.Event(), asyncio.Event()
        self._drained.set()
        self._loss_told = False
        self._mistake: Exception | None = None
        self.replaced = 0
        """Offered messages that a newer one overtook."""
        self.connects = 0

    def attach(
        self,
        subscriptions: Mapping[str, int],
        on_message: Callable[[str, bytes], None],
        on_connect: Callable[[], None] = lambda: None,
        on_loss: Callable[[], None] = lambda: None,
        on_passed_over: Callable[[str, int], None] = lambda _topic, _count: None,
    ) -> None:
        """Set the readers, before ``run``; they may be built after the link.

        Args:
            subscriptions: As above, and so for the others.
            on_message: Called with each message.
            on_connect: Called after every (re)connect.
            on_loss: Called once when a connection is lost.
            on_passed_over: Called with messages that were not handed over.
        """
        self._subscriptions = dict(subscriptions)
        self._on_message = on_message
        self._on_connect = on_connect
        self._on_loss = on_loss
        self._on_passed_over = on_passed_over

    @property
    def offered(self) -> int:
        """Number of topics with a message that waits to be sent."""
        return len(self._offered)

    @property
    def connected(self) -> bool:
        """Whether the broker has accepted us and has not gone since."""
        return self._client is not None

    async def run(self) -> None:
        """Stay connected until cancelled."""
        pause = _FIRST_PAUSE_S
        while True:
            try:
                await self._session()
            except (aiomqtt.MqttError, OSError) as error:
                _heed_cancellation()
                if self._mistake is not None:
                    raise self._mistake from None
                if not self._loss_told:
                    _log.warning("%s: broker lost: %s", self._name, error)
                    self._loss_told = True
            else:
                # Its certificate is another: nobody has to wait for a broker.
                self._client = None
                self._on_loss()
                continue
            if self._client is not None:
                self._client = None
                pause = _FIRST_PAUSE_S
                self._on_loss()
            await asyncio.sleep(pause * random.uniform(0.5, 1.0))  # noqa: S311 - jitter
            pause = min(_LONGEST_PAUSE_S, 2 * pause)

    async def _session(self) -> None:
        address, files = self._address, self._address.files.state()
        async with OutboxClient(
            address.host,
            address.port,
            username=address.user,
            password=address.password,
            keepalive=_KEEPALIVE_S,
            timeout=_ANSWERED_WITHIN_S,
            tls_context=address.context(),
            socket_options=NODELAY,
            on_arrived=self._hand_over,
            apart_s=self._apart_s,
        ) as client:
            self._early.clear()
            for topic_filter, qos in self._subscriptions.items():
                await client.subscribe(topic_filter, qos=qos)
            _heed_cancellation()
            self._client = client
            self._loss_told = False
            self.connects += 1
            _log.info("%s: connected to the broker", self._name)
            self._on_connect()
            sender = asyncio.create_task(
                self._send_offered(client), name=f"mqtt-send-{self._name}"
            )
            try:
                self._hand_qos1(self._early)
                await self._until_over(client, files)
            finally:
                sender.cancel()

    async def _until_over(self, client: OutboxClient, files: FileState) -> None:
        """Until the connection is lost (MqttError), or its certificate is another."""
        lost = asyncio.ensure_future(client.lost())
        try:
            while True:
                await asyncio.wait({lost}, timeout=self._look_every_s)
                if lost.done():
                    return lost.result()
                now = self._address.files.state()
                if now != files and self._can_connect():
                    _log.info("%s: a new certificate: connecting anew", self._name)
                    return None
                files = now
        finally:
            lost.cancel()

    def _can_connect(self) -> bool:
        """Whether the files fit together: half-written ones end no connection."""
        try:
            self._address.context()
        except OSError as error:
            _log.warning("%s: certificate not used: %s", self._name, error)
            return False
        return True

    def _hand_over(self, arrived: Arrived) -> None:
        """A mistake of ours in here must end ``run``, and not the connection alone."""
        try:
            for topic, count in arrived.passed_over.items():
                self._on_passed_over(topic, count)
            for topic, payload in arrived.telemetry.items():
                self._on_message(topic, payload)
            if self._client is None:
                self._early.extend(arrived.qos1)
            else:
                self._hand_qos1(arrived.qos1)
        except Exception as error:
            self._mistake = error
            raise

    def _hand_qos1(self, messages: Iterable[Qos1Message]) -> None:
        for message in messages:
            self._on_message(message.topic, message.payload)

    async def _send_offered(self, client: OutboxClient) -> None:
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._offered:
                offered, self._offered = self._offered, {}
                client.send(_of_qos(0, offered))
                if confirmed := _of_qos(1, offered):
                    await self._send_confirmed(client, confirmed)
                await client.written()
            self._drained.set()

    async def _send_confirmed(
        self, client: OutboxClient, messages: list[tuple[str, bytes]]
    ) -> None:
        try:
            await client.confirmed(messages, _ANSWERED_WITHIN_S)
        except aiomqtt.MqttError:
            # A broker that is slow to confirm may still be there; when it is gone, the
            # session ends and this task with it.
            _log.debug("%s: not all of %d confirmed", self._name, len(messages))

    def enqueue(self, topic: str, payload: bytes, qos: int = 0) -> None:
        """Send when possible; a newer message of the topic takes its place."""
        if topic in self._offered:
            self.replaced += 1
        self._offered[topic] = (payload, qos)
        self._drained.clear()
        self._wake.set()

    async def drained(self) -> None:
        """Return when the socket has everything that was offered."""
        await self._drained.wait()

    async def publish(
        self, topic: str, payload: bytes, qos: int = 1, *, retain: bool = False
    ) -> None:
        """Send now; at QoS 1 return when the broker has it.

        Raises:
            HopError: not connected, or the broker did not confirm.
        """
        client = self._client
        if client is None:
            raise HopError("mqtt", "not connected")
        try:
            within_s = _CONFIRMED_WITHIN_S
            if qos:
                await client.confirmed([(topic, payload)], within_s, retain=retain)
            else:
                await client.publish(topic, payload, retain=retain, timeout=within_s)
        except aiomqtt.MqttError as error:
            _heed_cancellation()
            raise HopError("mqtt", str(error)) from error
        _heed_cancellation()


def _of_qos(
    wanted: int, offered: Mapping[str, tuple[bytes, int]]
) -> list[tuple[str, bytes]]:
    """The offered topics and payloads of one quality of service."""
    return [
        (topic, payload) for topic, (payload, qos) in offered.items() if qos == wanted
    ]


def _heed_cancellation() -> None:
    """Raise the cancellation that somebody asked for.

    Before Python 3.12 ``asyncio.wait_for``, which aiomqtt uses, may swallow a
    cancellation that meets its result; the task would live on and the part never end.
    """
    task = asyncio.current_task()
    if task is not None and task.cancelling():
        raise asyncio.CancelledError
