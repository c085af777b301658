"""Topics as JSON frames, each version encoded once for all browsers."""

from iveg.domain.observations import Instant
from iveg.models.base import write_json
from iveg.vital import topics
from iveg.vital.ports import Clock
from iveg.vital.publish import Hub
from iveg.web.live.telemetry import TelemetryEncoder
from iveg.web.views import Views


class Encoder:
    """Encodes topics as frames, each version once."""

    def __init__(self, views: Views, hub: Hub, clock: Clock) -> None:
        self._views, self._hub, self._clock = views, hub, clock
        self.telemetry = TelemetryEncoder(views, hub)
        self._frames: dict[str, tuple[int, bytes]] = {}

    def frame(self, topic: str) -> bytes | None:
        """The newest frame of a topic without pacing; None without data."""
        version = self._hub.versions[topic]
        cached = self._frames.get(topic)
        if cached is not None and cached[0] == version:
            return cached[1]
        frame = self._encode(topic)
        if frame is not None:
            self._frames[topic] = version, frame
        return frame

    def _encode(self, topic: str) -> bytes | None:
        now, row = self._clock(), topics.find(topic)[0]
        data = None if row.read is None else row.read(self._views, now)
        return None if data is None else frame_text(topic, data, now)

    def event(self, topic: str, item: object) -> bytes:
        """The frame of an event, which is never dropped."""
        now = self._clock()
        return frame_text(
            topic, topics.find(topic)[0].tell(self._views, item, now), now
        )


def frame_text(topic: str, data: object, now: Instant) -> bytes:
    """A JSON frame; ``at`` is when it was true, on the server's monotonic clock."""
    return write_json({"topic": topic, "data": data, "at": now.mono})
