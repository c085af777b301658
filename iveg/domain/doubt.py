"""Doubt about one robot: what it says contradicts itself or physics.

::

    consistent ── contradicted for longer than a round trip ──> doubted
               <── nothing of it contradicted for a second ────

A doubt is named by a code, lowers speeds and never raises one
(docs/safety.md, "Clear").
"""

from dataclasses import dataclass, field
from typing import NamedTuple

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant


class _Spell(NamedTuple):
    """From the first to the newest contradiction of one code (monotonic, s)."""

    began: float
    newest: float


@dataclass(slots=True)
class Doubts:
    """The contradictions of one robot, by code."""

    _spells: dict[str, _Spell] = field(default_factory=dict)

    def contradicted(self, code: str, now: Instant) -> None:
        """Note that a contradiction of this code was found now."""
        spell = self._spells.get(code)
        if spell is None or self._is_over(spell, now):
            spell = _Spell(now.mono, now.mono)
        self._spells[code] = _Spell(spell.began, now.mono)

    @property
    def were_raised(self) -> bool:
        """Whether anything was ever contradicted."""
        return bool(self._spells)

    def active(self, now: Instant) -> tuple[str, ...]:
        """Codes of the doubts that count now, the oldest first."""
        if not self._spells:
            return ()
        return tuple(
            code
            for code, spell in self._spells.items()
            if spell.newest - spell.began > LIMITS.round_trip_s
            and not self._is_over(spell, now)
        )

    def is_open(self, now: Instant) -> bool:
        """Whether anything is contradicted, however shortly."""
        return not all(self._is_over(one, now) for one in self._spells.values())

    @staticmethod
    def _is_over(spell: _Spell, now: Instant) -> bool:
        return now.mono - spell.newest > LIMITS.doubt_ends_s
