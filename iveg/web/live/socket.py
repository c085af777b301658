"""The WebSocket to browsers: a snapshot, then changes.

A message is encoded once for all browsers.  Each browser has one task that sends the
newest values; a browser that reads nothing keeps no queue and is closed after a while
(fault F23).  Telemetry goes in frames, as fast as a browser paints them; everything
else passes beside them at once.
"""

import asyncio
import logging
from collections.abc import Callable

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from iveg.domain.latency.watch import LatencyWatch
from iveg.domain.observations import Instant
from iveg.models.snapshot import Snapshot
from iveg.pipeline import topics
from iveg.pipeline.ports import Clock
from iveg.pipeline.publish import Hub
from iveg.web.live.client_messages import ClientMessages, Stop, current_principal
from iveg.web.live.encoder import Encoder, frame_text
from iveg.web.live.feed import TelemetryFeed
from iveg.web.live.line import Line, sent
from iveg.web.live.pacing import SUBPROTOCOL
from iveg.web.live.painting import Painting
from iveg.web.security.authentication import NO_SESSION
from iveg.web.security.requirements import Reader
from iveg.web.security.roles import Principal

_log = logging.getLogger(__name__)
NO_PROTOCOL = 4406
"""Close code of a program that does not ask for ``iveg.2``."""
_CHECK_S = 0.5


def router(
    hub: Hub,
    encoder: Encoder,
    snapshot: Callable[[Principal, Instant], Snapshot],
    clock: Clock,
    stop: Stop,
    latency: LatencyWatch,
) -> APIRouter:
    """The live endpoint.

    ``snapshot`` gives the present state to a new browser; ``stop``
    presses STOP for one robot, or for all, by somebody; ``latency`` is told when pages
    have drawn what was decided.
    """
    routes = APIRouter()

    @routes.websocket("/live")
    async def live(
        websocket: WebSocket,
        principal: Reader,
    ) -> None:
        """Serve one browser."""
        if SUBPROTOCOL not in websocket.scope.get("subprotocols", ()):
            # Close codes are seen only after the handshake.
            await websocket.accept()
            await websocket.close(NO_PROTOCOL)
            return
        await websocket.accept(SUBPROTOCOL)
        subscriber = hub.join()
        line = Line(websocket, subscriber, encoder, clock)
        feed = TelemetryFeed(encoder.telemetry, subscriber, Painting(latency))
        try:
            now = clock()
            await line.say(
                frame_text(topics.SNAPSHOT.name, snapshot(principal, now), now)
            )
            async with asyncio.TaskGroup() as tasks:
                sender = tasks.create_task(line.send(feed), name="live-send")
                watcher = tasks.create_task(
                    _watch(websocket, principal, line), name="live-watch"
                )
                ear = ClientMessages(
                    websocket, subscriber, clock, stop, principal, feed
                )
                tasks.create_task(ear.listen((sender, watcher)), name="live-listen")
        except* (WebSocketDisconnect, ConnectionError) as gone:
            _log.debug("browser gone: %s", gone)
        except* Exception:
            # A fault of ours, logged as one; the browser reconnects by itself.
            _log.exception("live: the line of a browser has failed")
        finally:
            hub.leave(subscriber)

    return routes


async def _watch(websocket: WebSocket, principal: Principal, line: Line) -> None:
    """Close soon after the session is over, or when the browser reads nothing.

    STOP stays possible over HTTP.
    """
    while True:
        await asyncio.sleep(_CHECK_S)
        if current_principal(websocket, principal, "read") is None:
            await sent(websocket.close(NO_SESSION))
            return
        if line.is_stuck:
            await line.close_slow()
            return
