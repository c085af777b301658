"""The line to one browser: its messages, one after the other."""

import asyncio
from collections.abc import Coroutine

from fastapi import WebSocket

from iveg.pipeline.ports import Clock
from iveg.pipeline.publish import Subscriber
from iveg.web.live.encoder import Encoder
from iveg.web.live.feed import TelemetryFeed

TOO_SLOW = 4008
_SEND_LIMIT_S = 10.0


class Line:
    """The messages to one browser, one after the other.

    Args:
        limit_s: How long a browser may take to read one.
    """

    def __init__(
        self,
        websocket: WebSocket,
        subscriber: Subscriber,
        encoder: Encoder,
        clock: Clock,
        limit_s: float = _SEND_LIMIT_S,
    ) -> None:
        self._websocket = websocket
        self._subscriber = subscriber
        self._encoder = encoder
        self._clock = clock
        self._limit_s = limit_s
        self._sending_since: float | None = None

    async def say(self, frame: bytes) -> None:
        """Send JSON."""
        await sent(self._websocket.send_text(frame.decode()))

    async def send(self, feed: TelemetryFeed) -> None:
        """Everything, as fast as the browser reads; telemetry as fast as it paints."""
        loop = asyncio.get_running_loop()
        while not self._subscriber.overflowed:
            self._sending_since = None
            await self._subscriber.news(feed.wait_s(self._clock().mono))
            self._sending_since = loop.time()
            await self._send_frame(feed)
            await self._send_news()
            feed.write_ahead(self._clock())
        await self.close_slow()

    @property
    def is_stuck(self) -> bool:
        """Whether the browser has not read for long."""
        since = self._sending_since
        now = asyncio.get_running_loop().time()
        return since is not None and now - since > self._limit_s

    async def close_slow(self) -> None:
        """Close: the browser reads too slowly."""
        await sent(self._websocket.close(TOO_SLOW))

    async def _send_frame(self, feed: TelemetryFeed) -> None:
        frame = feed.next_frame(self._clock())
        if frame is not None:
            await sent(self._websocket.send_bytes(frame))

    async def _send_news(self) -> None:
        for topic, item in self._subscriber.drain_events():
            await self.say(self._encoder.event(topic, item))
        for topic in self._subscriber.drain_topics():
            frame = self._encoder.frame(topic)
            if frame is not None:
                await self.say(frame)


async def sent(sending: Coroutine[object, object, None]) -> None:
    """Send; of a socket that has closed meanwhile a server says RuntimeError.

    Raises:
        ConnectionResetError: the browser is gone.
    """
    try:
        await sending
    except RuntimeError as error:
        raise ConnectionResetError(str(error)) from error
