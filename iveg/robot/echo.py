"""Newest feedback that this robot received, sent back as proof of the message age.

Every message names the newest feedback that the robot had received when it measured;
its content was measured after that feedback left iVeg (docs/interfaces/mqtt.md).
"""

from iveg.domain.observations import FeedbackRef, Origin
from iveg.domain.stream_order import StreamOrder


class Echo:
    """Reference to the newest feedback, of any topic: iVeg counts all topics as one."""

    def __init__(self) -> None:
        self._order = StreamOrder()
        self.heard: FeedbackRef | None = None
        """None before the first feedback."""

    def note(self, feedback: Origin) -> None:
        """Store the reference of a feedback that could be read."""
        if feedback.boot is None or feedback.seq is None:
            return
        if self._order.judge(feedback) == "new":
            self.heard = FeedbackRef(feedback.boot, feedback.seq)
