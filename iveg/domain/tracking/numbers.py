"""Ids of tracks: unique for ever, with a number that starts anew each day (UTC)."""

from collections.abc import Iterable
from dataclasses import dataclass

from iveg.domain.observations import Instant

_DAY_S = 86400.0


@dataclass(slots=True)
class TrackNumbers:
    """Gives out ids.

    Attributes:
        era: Ends every id, with the day, so that no later start makes the same one.
    """

    era: str = ""
    _day: int = -1
    _shown: int = 0

    def next_id(self, kind: str, at: Instant, known: Iterable[str]) -> str:
        """A new id; its number is none of those that are ``known``."""
        day = int(at.wall // _DAY_S)
        if day != self._day:
            self._day, self._shown = day, 0
        in_use = {one.partition("-")[0] for one in known}
        self._shown += 1
        while f"{kind}{self._shown}" in in_use:
            self._shown += 1
        return f"{kind}{self._shown}" + (self.era and f"{self.era}{day:x}")
