"""A clock that stands until it is moved."""

from iveg.domain.observations import Instant
from tests.builders import at


class FakeClock:
    """Implements ``vital.ports.Clock``; ``now`` counts seconds from the start."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> Instant:
        return at(self.now)
