"""Each detection of the last moments, as the rule judged it; the history keeps fewer.

Bounded, and in memory alone: two robots that see three objects in thirty pictures a
second fill it in half a minute (docs/interfaces/http.md, "Each detection").
"""

from collections import deque
from collections.abc import Callable
from itertools import islice
from typing import NamedTuple

from iveg.domain.observations import DetectionFrame, Received
from iveg.domain.records import DetectionRecord
from iveg.domain.tracking.people import Placed
from iveg.vital.event_log import detection_of

MOST_DETECTIONS = 5000


class JudgedDetection(NamedTuple):
    """A detection, the frame that it came in and how that came; its row is made later.

    Making every row at once would cost the rule loop what nobody may ask for.
    """

    one: Placed
    frame: DetectionFrame
    received: Received


class NewestDetections:
    """The last detections of the whole fleet; the oldest gives way."""

    def __init__(self) -> None:
        self._newest: deque[JudgedDetection] = deque(maxlen=MOST_DETECTIONS)

    def note(self, one: Placed, frame: DetectionFrame, received: Received) -> None:
        """Remember one detection."""
        self._newest.append(JudgedDetection(one, frame, received))

    def rows(
        self, admits: Callable[[JudgedDetection], bool], most: int
    ) -> tuple[DetectionRecord, ...]:
        """At most so many of those that are admitted, newest first."""
        admitted = filter(admits, reversed(self._newest))
        return tuple(detection_of(*one) for one in islice(admitted, most))
