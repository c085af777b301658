"""What this robot has heard of iVeg, told back so that iVeg can prove our age.

Every message of ours names the newest feedback that we had heard when we measured;
what is in it was measured after that feedback left iVeg (docs/interfaces/mqtt.md).
"""

from iveg.domain.observations import FeedbackRef, Origin
from iveg.domain.order import StreamOrder


class Echo:
    """Keeps the newest feedback, of whatever topic: iVeg counts them all as one."""

    def __init__(self) -> None:
        self._order = StreamOrder()
        self.heard: FeedbackRef | None = None
        """None before the first."""

    def take(self, feedback: Origin) -> None:
        """A feedback that could be read has come."""
        if feedback.boot is None or feedback.seq is None:
            return
        if self._order.judge(feedback) == "new":
            self.heard = FeedbackRef(feedback.boot, feedback.seq)
