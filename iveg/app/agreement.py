"""How a world of the past compares with the live one."""

from dataclasses import dataclass

import orjson

from iveg.domain.observations import Instant
from iveg.models.base import write_json
from iveg.pipeline import topics
from iveg.pipeline.topics import StateReader

_NOT_HASHED = topics.LOG, topics.HEALTH, topics.MAP
"""They tell of the server, and not of the world."""


def picture(views: StateReader, now: Instant) -> bytes:
    """The world as it is hashed: what a page is shown, but of the server itself."""
    rows = (row for row in topics.TOPICS if row not in _NOT_HASHED)
    body = write_json({row.member: row.read(views, now) for row in rows if row.read})
    # Some parts keep things in sets, which are in no order.
    return orjson.dumps(orjson.loads(body), option=orjson.OPT_SORT_KEYS)


@dataclass(slots=True)
class Agreement:
    """How the hashes of a run compare: with the live ones, so far.

    Attributes:
        newest: Of the last one that was passed; None: of none yet.
    """

    equal: int = 0
    unequal: int = 0
    newest: bool | None = None

    def note(self, is_equal: bool) -> None:
        """One more."""
        self.newest = is_equal
        self.equal += is_equal
        self.unequal += not is_equal
