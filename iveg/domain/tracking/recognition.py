"""Who of the lost has come back: by place, time, speed, and the ways on foot.

Somebody appears.  They are one of the lost who may have walked there, if that is likely
enough: the negative log-likelihood of a normal distribution whose spread grows with the
time, faster for who walked than for who stood; or of one around a place of theirs, as
people come back to their work.  The longer they have been in sight, the less likely a
way is asked for: a detector's mistake is over soon, so it takes nobody's name.
"""

import math
from collections.abc import Callable, Iterable, Iterator

from iveg.domain.limits import LIMITS
from iveg.domain.tracking.person import MISTAKEN_S, Sighting, TrackedPerson

Way = Callable[[float, float, float, float], float]
"""x, y of two places in ``map`` → length of the way between them (m)."""

_GATE_M = 1.0
_MOST_COST = 6.5
"""Likelier ways are believed; of one beyond, it is somebody new."""
_SPREAD_M, _STOOD_M_S, _WALKED, _SPREAD_MOST_M = 1.2, 0.1, 0.2, 4.0
"""Spread when just lost, how fast it grows for who stood (m/s), and for who walked as a
share of the speed; its bound.  These and those below: ``benchmarks/tracking.py``."""
_HABIT_M, _HABIT_COST = 2.0, 0.5
"""Spread around a place where they were before, and what it costs to have left it."""


def straight(ax: float, ay: float, bx: float, by: float) -> float:
    """The way where nothing is known to stand (m)."""
    return math.hypot(bx - ax, by - ay)


def recognised(
    person: TrackedPerson, lost: Iterable[TrackedPerson], way: Way
) -> TrackedPerson | None:
    """Who of the lost somebody most likely is; None: nobody.

    Args:
        person: Who appeared, and has no name yet.
        lost: Well known, and not seen since ``person`` appeared.
        way: Asked for few, as no way is shorter than the straight one.
    """
    here = person.began
    found, least = None, _MOST_COST * min(1.0, person.followed_s / MISTAKEN_S)
    guesses = [
        (cost(straight(last.x, last.y, here.x, here.y)), one.number, cost, last, one)
        for one in lost
        for cost, last in _costs(one, here)
    ]
    for at_best, _, cost, last, one in sorted(guesses, key=lambda guess: guess[:2]):
        if at_best > least:
            break
        real = cost(way(last.x, last.y, here.x, here.y))
        if real <= least:
            found, least = one, real
    return found


_Cost = Callable[[float], float]
"""Of a way so long (m)."""


def _costs(one: TrackedPerson, here: Sighting) -> Iterator[tuple[_Cost, Sighting]]:
    """From where they may have come, and what the way costs."""
    for last in one.last_places:
        if not last.reach_m and not here.reach_m:
            yield _walked(last, here), last
            if _can_walk(last, here):
                yield from ((_came_back, place) for place in one.places)


def _can_walk(last: Sighting, here: Sighting) -> bool:
    most = _GATE_M + LIMITS.walking_m_s * last.age_s(here.at)
    return straight(last.x, last.y, here.x, here.y) <= most


def _walked(last: Sighting, here: Sighting) -> _Cost:
    age = last.age_s(here.at)
    grows = _STOOD_M_S + _WALKED * math.hypot(last.vx, last.vy)
    spread = min(_SPREAD_MOST_M, _SPREAD_M + grows * age)
    most = _GATE_M + LIMITS.walking_m_s * age

    def cost(far: float) -> float:
        if far > most:
            return math.inf
        return (far / spread) ** 2 / 2 + 2 * math.log(spread / _SPREAD_M)

    return cost


def _came_back(far: float) -> float:
    return (far / _HABIT_M) ** 2 / 2 + _HABIT_COST
