"""MQTT: a link of at least one connection that reconnects by itself.

``run`` connects, subscribes and hands every message on as it is read; after a loss it
tries again with a growing, jittered pause.  ``publish`` waits for the confirmation of
the broker (QoS 1) and raises; ``enqueue`` keeps only the newest message of each topic,
for telemetry.
"""

import asyncio
import logging
import math
import random
import socket
import ssl
from collections.abc import Callable, Mapping, Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass
from typing import Any
from urllib.parse import unquote, urlsplit

import aiomqtt

from iveg.domain.errors import HopError

# --- certificates -----------------------------------------------------------------
#
# TLS to the broker: trusted authorities, and the certificate that names a program.
#
# The files are read at each connection.


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """Files in PEM; each may be empty.

    Attributes:
        authority: Certificates that are trusted; empty: those of the system.
        certificate: Own certificate with its chain; ``key`` its private key.
    """

    authority: str = ""
    certificate: str = ""
    key: str = ""

    def context(self) -> ssl.SSLContext:
        """Context of a connection, from the files as they are now.

        Raises:
            OSError: a file is missing or is no certificate (``ssl.SSLError``).
        """
        context = ssl.create_default_context(cafile=self.authority or None)
        if self.certificate:
            context.load_cert_chain(self.certificate, self.key or None)
        return context


NO_FILES = TlsFiles()
_NODELAY = [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)]

# --- the address ------------------------------------------------------------------
#
# Address of a broker, and its client.


@dataclass(frozen=True, slots=True)
class BrokerAddress:
    """Address of the broker, user and password, and the files of TLS."""

    host: str
    port: int
    user: str | None = None
    password: str | None = None
    tls: bool = False
    files: TlsFiles = NO_FILES

    @classmethod
    def from_url(
        cls, url: str, user: str = "", password: str = "", files: TlsFiles = NO_FILES
    ) -> "BrokerAddress":
        """Read ``mqtt://user:password@host:port``; arguments win over the URL."""
        parts = urlsplit(url)
        tls = parts.scheme == "mqtts"
        return cls(
            parts.hostname or "127.0.0.1",
            parts.port or (8883 if tls else 1883),
            user or unquote(parts.username or "") or None,
            password or unquote(parts.password or "") or None,
            tls,
            files,
        )

    def client(self, **options: Any) -> aiomqtt.Client:
        """Client that is not connected yet; TLS from the files as they are now.

        Raises:
            OSError: a file is missing or is no certificate.
        """
        return aiomqtt.Client(
            self.host,
            self.port,
            username=self.user,
            password=self.password,
            tls_context=self.files.context() if self.tls else None,
            socket_options=_NODELAY,
            **options,
        )


# --- the connection ---------------------------------------------------------------

_log = logging.getLogger(__name__)
# aiomqtt warns of every message that waits for its confirmation.
logging.getLogger("mqtt").setLevel(logging.ERROR)
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.2, 2.0
_KEEPALIVE_S = 5
_ANSWERED_WITHIN_S, _CONFIRMED_WITHIN_S = 5.0, 1.5


class MqttLink:
    """A connection to the broker that lives as long as ``run`` does.

    Args:
        address: The broker.
        name: Names the connection in logs; client ids stay random.
        subscriptions: Topic filter → QoS, subscribed to on every connect.
        on_message: Called in the loop with topic and payload; must not block.  None:
            the link only sends.

    Attributes:
        drained: Set while no offered message waits for the socket.
    """

    def __init__(
        self,
        address: BrokerAddress,
        name: str,
        subscriptions: Mapping[str, int] | None = None,
        on_message: Callable[[str, bytes], None] | None = None,
    ) -> None:
        self._address, self._name = address, name
        self.attach(subscriptions or {}, on_message)
        self._client: aiomqtt.Client | None = None
        self._offered: dict[str, tuple[bytes, int]] = {}
        self._wake, self.drained = asyncio.Event(), asyncio.Event()
        self.drained.set()
        self._loss_logged = False
        self._reader_error: Exception | None = None
        self.replaced = 0
        """Offered messages that a newer one of their topic replaced."""

    def attach(
        self,
        subscriptions: Mapping[str, int],
        on_message: Callable[[str, bytes], None] | None,
        on_change: Callable[[bool], None] | None = None,
        on_stored: Callable[[str, bytes], None] | None = None,
        apart: Sequence[Mapping[str, int]] = (),
    ) -> None:
        """Set the readers, before ``run``; they may be built after the link.

        Args:
            subscriptions: As above, and so for the others.
            apart: Subscriptions with a connection of their own each; all connections
                come and go together.  A turn of the loop reads one message for each
                connection, so a flood on one delays no message of another.
            on_message: Called with each message.
            on_change: Called with True after every (re)connect, subscriptions in place,
                and with False once when a connection is lost.
            on_stored: Called with messages that the broker retained; None:
                ``on_message`` is.
        """
        # The last connection carries the orders.
        self._subscriptions = (*apart, subscriptions)
        self._on_message, self._on_change = on_message, on_change
        self._on_stored = on_stored or on_message

    @property
    def offered(self) -> int:
        """Number of topics with a message that waits to be sent."""
        return len(self._offered)

    @property
    def connected(self) -> bool:
        """Whether the broker has accepted all connections and none is lost since."""
        return self._client is not None

    async def run(self) -> None:
        """Stay connected until cancelled."""
        pause = _FIRST_PAUSE_S
        while True:
            try:
                await self._session()
            except (aiomqtt.MqttError, OSError) as error:
                _heed_cancellation()
                # A reader that failed would fail at the next message, too.
                if self._reader_error is not None:
                    raise self._reader_error from None
                if not self._loss_logged:
                    _log.warning("%s: broker lost: %s", self._name, error)
                    self._loss_logged = True
            if self._client is not None:
                self._client = None
                pause = _FIRST_PAUSE_S
                if self._on_change is not None:
                    self._on_change(False)
            # Jitter: after a restart of the broker not all programs connect at once.
            await asyncio.sleep(pause * random.uniform(0.5, 1.0))  # noqa: S311
            pause = min(_LONGEST_PAUSE_S, 2 * pause)

    async def _session(self) -> None:
        """Connect and serve, until an error or a cancellation."""
        ends = list[asyncio.Future[None]]()
        try:
            async with AsyncExitStack() as connections:
                for subscriptions in self._subscriptions:
                    client = await connections.enter_async_context(self._new_client())
                    ends.append(asyncio.ensure_future(_wait_for_end(client)))
                    for topic_filter, qos in subscriptions.items():
                        await client.subscribe(topic_filter, qos=qos)
                # One may have been swallowed while connecting.
                _heed_cancellation()
                await self._serve(client, ends)
        finally:
            # asyncio complains of each error that nobody has fetched.
            await asyncio.gather(*ends, return_exceptions=True)

    async def _serve(
        self, client: aiomqtt.Client, ends: Sequence[asyncio.Future[None]]
    ) -> None:
        """Receive and send, until a connection is lost."""
        self._client = client
        self._loss_logged = False
        _log.info("%s: connected to the broker", self._name)
        if self._on_change is not None:
            self._on_change(True)
        sender = asyncio.create_task(
            self._send_offered(client), name=f"mqtt-send-{self._name}"
        )
        try:
            done, _ = await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
            done.pop().result()
        finally:
            sender.cancel()

    def _new_client(self) -> aiomqtt.Client:
        return self._address.client(
            keepalive=_KEEPALIVE_S,
            timeout=_ANSWERED_WITHIN_S,
            queue_type=_queue_type(self._hand_over),
            # A STOP never waits until the broker has confirmed telemetry.
            max_inflight_messages=0,
        )

    def _hand_over(self, message: aiomqtt.Message) -> None:
        """Call the reader of a message; its error ends ``run``, not the connection."""
        reader = self._on_stored if message.retain else self._on_message
        try:
            if reader is not None:
                reader(message.topic.value, message.payload)
        except Exception as error:
            self._reader_error = error
            raise

    async def _send_offered(self, client: aiomqtt.Client) -> None:
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._offered:
                offered, self._offered = self._offered, {}
                await self._send(client, offered)
            self.drained.set()

    async def _send(
        self, client: aiomqtt.Client, messages: Mapping[str, tuple[bytes, int]]
    ) -> None:
        """Return when the socket (QoS 0) or broker (QoS 1) has them, or after 5 s.

        A broker that confirms late may still be connected.  If it is not, the session
        ends and its sender with it.
        """
        sending = asyncio.gather(
            *(
                client.publish(topic, payload, qos, timeout=math.inf)
                for topic, (payload, qos) in messages.items()
            ),
            return_exceptions=True,
        )
        failed: list[BaseException]
        try:
            # One timer for all: aiomqtt's own timer costs a task for each message.
            async with asyncio.timeout(_ANSWERED_WITHIN_S):
                failed = list(filter(None, await sending))
        except TimeoutError as error:
            failed = [error]
        if failed:
            count = len(messages)
            _log.debug("%s: %d messages not all sent: %r", self._name, count, failed[0])

    def enqueue(self, topic: str, payload: bytes, qos: int = 0) -> None:
        """Send when possible; a newer message of the topic replaces this one."""
        if topic in self._offered:
            self.replaced += 1
        self._offered[topic] = (payload, qos)
        self.drained.clear()
        self._wake.set()

    async def publish(
        self, topic: str, payload: bytes, qos: int = 1, *, retain: bool = False
    ) -> None:
        """Send now; at QoS 1 return when the broker has confirmed.

        Raises:
            HopError: not connected, or the broker did not confirm.
        """
        client = self._client
        if client is None:
            raise HopError("mqtt", "not connected")
        try:
            await client.publish(
                topic, payload, qos, retain, timeout=_CONFIRMED_WITHIN_S
            )
        except aiomqtt.MqttError as error:
            _heed_cancellation()
            raise HopError("mqtt", str(error)) from error
        _heed_cancellation()


def _queue_type(
    take: Callable[[aiomqtt.Message], None],
) -> type[asyncio.Queue[aiomqtt.Message]]:
    """Type of a client's queue that keeps nothing: no message grows old in it.

    aiomqtt's iterator costs a task for each message, a third of reading a message.
    """

    class Intake(asyncio.Queue[aiomqtt.Message]):
        def put_nowait(self, message: aiomqtt.Message) -> None:
            take(message)

    return Intake


async def _wait_for_end(client: aiomqtt.Client) -> None:
    """Wait for the end of the connection.

    Raises:
        MqttError: it has ended.
    """
    async for _ in client.messages:
        """No message comes this way."""


def _heed_cancellation() -> None:
    """Raise the cancellation that this task has been sent.

    Before Python 3.12 ``asyncio.wait_for``, which aiomqtt uses, may swallow a
    cancellation that meets its result; the task would live on and the part never end.
    """
    task = asyncio.current_task()
    if task is not None and task.cancelling():
        raise asyncio.CancelledError


# --- one message there and back ---------------------------------------------------
#
# The MQTT side of ``iveg doctor``.  It reports the reason of a failure, where a running
# iVeg tries again.


async def publish_and_receive(
    address: BrokerAddress, topic: str, payload: bytes
) -> None:
    """Publish a message at QoS 1; return when the broker has sent it back.

    Raises:
        HopError: the broker is away or refuses the user.
    """
    try:
        async with address.client() as client:
            await client.subscribe(topic, qos=1)
            await client.publish(topic, payload, qos=1)
            async for message in client.messages:
                if message.payload == payload:
                    return
    except (aiomqtt.MqttError, OSError) as error:
        raise HopError("mqtt", str(error) or type(error).__name__) from error
