"""Input of what robots kept during a gap: bounded here, and never queued with live.

A batch that is not read (too large, a flood) is not recorded either.
"""

from collections.abc import Callable, Iterable
from functools import partial

from iveg.adapters.direct import Recorded
from iveg.domain.backfill import Batch
from iveg.domain.errors import UnreadableError
from iveg.domain.observations import Instant
from iveg.ngsi import codec, names


class BackfillReader:
    """Reads ``/{robot}/iveg/backfill``.

    Args:
        robots: Of the fleet.
        clock: Reads both clocks.
        has_room: Whether a robot may send a batch now.
        accept: Where batches go.
        reject: Where the unreadable is counted.
        recorded: Told of each batch that is read.
    """

    def __init__(
        self,
        robots: Iterable[str],
        clock: Callable[[], Instant],
        has_room: Callable[[str, Instant], bool],
        accept: Callable[[Batch, Instant], None],
        reject: Callable[[str, str, str], None],
        recorded: Recorded = lambda *_: None,
    ) -> None:
        self._clock, self._has_room, self._accept = clock, has_room, accept
        self._reject, self._recorded = reject, recorded
        self._robots = {
            names.BACKFILL_TOPIC.format(robot_id=one): one for one in robots
        }

    def subscriptions(self) -> dict[str, int]:
        """Topics and their QoS."""
        return dict.fromkeys(self._robots, 1)

    def beside(
        self, read: Callable[[str, bytes], None]
    ) -> Callable[[str, bytes], None]:
        """A reader of all topics that gives ``read`` those that are live."""
        return partial(self._read_or, read)

    def _read_or(
        self, live: Callable[[str, bytes], None], topic: str, payload: bytes
    ) -> None:
        robot_id = self._robots.get(topic)
        if robot_id is None:
            live(topic, payload)
        else:
            self.read(robot_id, topic, payload)

    def read(self, robot_id: str, topic: str, payload: bytes) -> None:
        """Take one message."""
        at = self._clock()
        if not self._has_room(robot_id, at):
            return
        try:
            batch, problems = codec.read_backfill(robot_id, payload)
        except UnreadableError as error:
            self._reject(robot_id, error.reason, error.detail)
            return
        self._recorded(topic, payload, at)
        for problem in problems:
            self._reject(problem.source, problem.reason, problem.detail)
        self._accept(batch, at)
