"""Δt₄: frames that a page reports as drawn, compared with their content.

Only frames that the server sent itself are measured, so a page can be wrong about the
moment alone; an impossible moment is counted and not used.
"""

from collections import deque
from collections.abc import Mapping
from typing import Final

from iveg.domain.latency.segments import Data
from iveg.domain.latency.watch import LatencyWatch
from iveg.pipeline import topics
from iveg.web.live.pacing import FRAMES
from iveg.web.presses import read_number

TRUSTED_S: Final = 0.1
"""Half the shortest round trip (s): how well a page knows the server's clock."""
SAMPLE_S: Final = 0.1
"""Between two samples of one topic and page: the hop is paced, and so is this."""
_SLACK_S: Final = 0.05

_MEASURED: Final[Mapping[topics.Topic, Data]] = {
    topics.ROBOT: "odometry",
    topics.SCAN: "lidar",
    topics.DETECTIONS: "detections",
}
_Sample = tuple[str, Data, float]


class Painting:
    """The frames of one page that are on their way, and what was decided in them."""

    def __init__(self, watch: LatencyWatch) -> None:
        self._watch = watch
        self._on_way: deque[tuple[int, float, list[_Sample]]] = deque(maxlen=FRAMES)
        self._sampled: dict[str, float] = {}
        self._samples: list[_Sample] = []

    def adds(self, topic: str, now: float) -> None:
        """Note that a topic goes with the next frame (``now`` monotonic, s)."""
        if now - self._sampled.get(topic, float("-inf")) < SAMPLE_S:
            return
        row, robot_id = topics.find(topic)
        data = _MEASURED.get(row)
        if data is None:
            return
        decided_at = self._watch.decided_at(robot_id, data)
        if decided_at is not None:
            self._sampled[topic] = now
            self._samples.append((robot_id, data, decided_at))

    def sent(self, number: int, now: float) -> None:
        """Note that the frame was sent."""
        self._on_way.append((number, now, self._samples))
        self._samples = []

    def painted(self, number: int, at: object, within: object, now: float) -> None:
        """Take a page's report that it drew a frame, and all before, at a moment.

        Args:
            number: Of the frame; it was on its way.
            at: When, on the server's monotonic clock (s); None: nothing was drawn.
            within: How wrong that may be (s).
            now: When this was heard (monotonic, s).
        """
        drawn_at, doubt_s = read_number(at), read_number(within)
        while self._on_way and self._on_way[0][0] <= number:
            _, sent_at, samples = self._on_way.popleft()
            if at is not None:
                for sample in samples:
                    self._judge(sample, sent_at, drawn_at, doubt_s, now)

    def _judge(
        self,
        sample: _Sample,
        sent_at: float,
        at: float | None,
        within: float | None,
        now: float,
    ) -> None:
        robot_id, data, decided_at = sample
        if at is None or within is None or within < 0.0:
            self._watch.not_painted(robot_id, data, "page_nonsense")
        elif within > TRUSTED_S:
            self._watch.not_painted(robot_id, data, "clock_untrusted")
        elif not sent_at - within - _SLACK_S <= at <= now + within + _SLACK_S:
            self._watch.not_painted(robot_id, data, "page_nonsense")
        else:
            self._watch.pages_within_s = within
            self._watch.painted(robot_id, data, decided_at, at)
