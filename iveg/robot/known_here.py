"""Places near this robot that iVeg knows: what stands still there slows it not.

They come with the robot's own feedback and end with it: without fresh feedback nothing
is known (docs/safety.md, "Known here").
"""

from iveg.domain.feedback import Feedback
from iveg.domain.known import MOST_TOLD, KnownPlace
from iveg.domain.limits import LIMITS


class KnownHere:
    """What the newest feedback to one robot calls known."""

    def __init__(self, robot_id: str) -> None:
        self._me = robot_id
        self._places: tuple[KnownPlace, ...] = ()

    def note(self, topic: str, feedback: Feedback) -> None:
        """Take a feedback that was accepted; only the robot's own counts."""
        if topic == self._me == feedback.robot_id:
            self._places = feedback.known_here[:MOST_TOLD]

    def places(self, feedback_age_s: float | None) -> tuple[KnownPlace, ...]:
        """Known places, while feedback is fresh."""
        is_fresh = (
            feedback_age_s is not None and feedback_age_s <= LIMITS.feedback_slow_s
        )
        return self._places if is_fresh else ()
