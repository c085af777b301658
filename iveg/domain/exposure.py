"""Exposure: how long today the fleet was closer to people than stopping takes.

Margins are evaluated a few times a second; each evaluation stands for the time since
the one before.  Unknown margins are counted apart: they are neither safe nor dangerous.
So is the margin to a person who was last seen more than a second ago: it shrinks with
their absence alone and was never measured.  Days are UTC days (docs/safety.md,
"Margins").
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from iveg.domain.limits import LIMITS
from iveg.domain.margins import SafetyMargin
from iveg.domain.observations import Instant

PERIOD_S = 0.5
"""Period of evaluations (s)."""
_LONGEST_S = 2 * PERIOD_S
"""An evaluation after a longer silence does not stand for all of it."""
_DAY_S = 86_400.0


@dataclass(frozen=True, slots=True)
class Worst:
    """The least margin of a day, and when it was."""

    margin: SafetyMargin
    at: Instant


@dataclass(frozen=True, slots=True)
class Exposure:
    """One day so far.

    Attributes:
        since: The first evaluation of the day.
        evaluated_at: The newest evaluation; ``evaluations`` how many there were.
        known_s: Time whose margins are known (s), with nobody near included.
        negative_s: The part of it in which some robot could not have stopped in time.
        unknown_s: Time in which some margin, or the whole fleet, was unknown (s).
    """

    since: Instant
    evaluated_at: Instant
    evaluations: int = 0
    known_s: float = 0.0
    negative_s: float = 0.0
    unknown_s: float = 0.0
    worst: Worst | None = None

    @property
    def share(self) -> float | None:
        """Negative share of the known time (0 to 1); None without known time."""
        return self.negative_s / self.known_s if self.known_s > 0.0 else None


@dataclass(slots=True)
class Exposures:
    """Keeps the account of the day.

    Attributes:
        today: None before the first evaluation.
    """

    today: Exposure | None = field(default=None)

    def due(self, now: Instant) -> bool:
        """Whether the next evaluation is due."""
        # Ticks come a little early; an evaluation must not wait for the one after.
        return (
            self.today is None
            or now.mono - self.today.evaluated_at.mono >= PERIOD_S - 1e-3
        )

    def update(
        self, margins: Sequence[SafetyMargin], now: Instant, *, seen: bool
    ) -> Exposure:
        """Take one evaluation of the margins.

        Args:
            margins: Of every robot with every person, as far as there are pairs.
            now: When.
            seen: Whether anything is known of any robot.
        """
        before = self.today
        if before is None or _day(before.since) != _day(now):
            before = Exposure(
                since=now, evaluated_at=now if before is None else before.evaluated_at
            )
        past = min(max(0.0, now.mono - before.evaluated_at.mono), _LONGEST_S)
        known = [one for one in margins if one.known and one.age_s <= LIMITS.seen_s]
        least = min(known, key=lambda one: one.margin_m, default=None)
        self.today = replace(
            _spend(before, past, least, whole=seen and len(known) == len(margins)),
            evaluated_at=now,
            evaluations=before.evaluations + 1,
            worst=_worse(before.worst, least, now),
        )
        return self.today


def _spend(
    day: Exposure, past: float, least: SafetyMargin | None, *, whole: bool
) -> Exposure:
    """Book the time; a margin that is known to be negative needs no other."""
    if least is not None and least.margin_m < 0.0:
        return replace(
            day, known_s=day.known_s + past, negative_s=day.negative_s + past
        )
    if not whole:
        return replace(day, unknown_s=day.unknown_s + past)
    return replace(day, known_s=day.known_s + past)


def _worse(
    worst: Worst | None, least: SafetyMargin | None, now: Instant
) -> Worst | None:
    if least is None or (worst is not None and worst.margin.margin_m <= least.margin_m):
        return worst
    return Worst(least, now)


def _day(at: Instant) -> int:
    return int(at.wall // _DAY_S)
