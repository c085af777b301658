"""What a robot of ours echoes of feedback, without the rest of the robot."""

from dataclasses import replace

from iveg.domain.feedback import Feedback
from iveg.domain.observations import Origin
from iveg.robot.feedback import Authors


class Echo:
    """Feedback of one robot, by author."""

    def __init__(self) -> None:
        self.authors = Authors("AGI", 1.0)

    def note(self, feedback: Origin, now: float) -> None:
        """Hear a feedback of which only its origin matters."""
        self.authors.apply("AGI", Feedback("AGI", feedback), None, None, now)

    def on(self, origin: Origin, now: float) -> Origin:
        """The origin of a message of the robot, with what it has heard."""
        first, *others = self.authors.echoes(now) or (None,)
        also = tuple(one for one in others if one is not None)
        return replace(origin, acknowledgements=True, heard=first, heard_also=also)
