"""The live door for Foxglove: a process of its own, fed as the one that writes is.

It is read only: it offers no publishing, no parameters, no services and no assets, and
takes nothing that a client sends.  It says how many subscriptions there are, so that it
is fed with nothing while there is none.
"""

import os
from threading import Lock
from typing import BinaryIO

import foxglove
import orjson
from foxglove.websocket import ChannelView, Client, ServerListener

from iveg.adapters.recordings.drawing import Drawing
from iveg.adapters.recordings.fed import answer, run_fed
from iveg.adapters.recordings.foxglove import channels_of
from iveg.adapters.recordings.incoming import Unpacking
from iveg.adapters.recordings.live_feed import HOST, DoorSetup
from iveg.adapters.recordings.mcap_file import Channel

BACKLOG = 64
"""Messages that wait for a slow viewer; the oldest gives way."""
_PIECE = 1 << 18
_NS = 10**9


class _Watchers(ServerListener):
    """Counts subscriptions; called by threads of the library."""

    def __init__(self, answers: BinaryIO) -> None:
        self._answers = answers
        self._lock = Lock()
        self._count = 0

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002
        """One more."""
        self._changed(1)

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002
        """One less."""
        self._changed(-1)

    def _changed(self, by: int) -> None:
        with self._lock:
            self._count += by
            answer(self._answers, {"subscriptions": self._count})


class Door:
    """A WebSocket server, and the channels that it offers from its beginning.

    Raises:
        RuntimeError: the port cannot be had.
    """

    def __init__(self, setup: DoorSetup, listener: ServerListener) -> None:
        self._context = foxglove.Context()
        offered = {
            one.topic: one for robot in setup.robots for one in channels_of(robot)
        }
        self._channels = {name: self._open(one) for name, one in offered.items()}
        self._server = foxglove.start_server(
            name="iVeg",
            host=HOST,
            port=setup.port,
            capabilities=[],
            server_listener=listener,
            context=self._context,
            message_backlog_size=BACKLOG,
        )

    def _open(self, channel: Channel) -> foxglove.Channel:
        schema = foxglove.Schema(
            name=channel.schema,
            encoding="jsonschema",
            data=orjson.dumps(channel.shape),
        )
        return foxglove.Channel(
            channel.topic, schema=schema, message_encoding="json", context=self._context
        )

    def show(self, channel: Channel, payload: bytes, wall: float) -> None:
        """Send a message of ``wall`` (Unix s) to whoever looks on."""
        self._channels[channel.topic].log(payload, log_time=round(wall * _NS))

    def close(self) -> None:
        """Let everybody go."""
        self._server.stop()


def serve(source: BinaryIO, answers: BinaryIO) -> None:
    """Show what comes until the source ends.  Raises RuntimeError: no such port."""
    setup = DoorSetup(**orjson.loads(source.readline()))
    door = Door(setup, _Watchers(answers))
    drawing, unpacking = Drawing(setup.apikey, setup.robots), Unpacking()
    while piece := os.read(source.fileno(), _PIECE):
        for came in unpacking.feed(piece):
            for channel, payload in drawing.messages(came):
                door.show(channel, payload, came.at.wall)
    door.close()


if __name__ == "__main__":
    run_fed(serve, RuntimeError)
