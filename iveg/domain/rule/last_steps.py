"""Who has just stopped, turned or set out: how they went on since the look before.

The velocity of a chain of sightings is smoothed and follows a walker's own by about
0.4 s.  The newest step alone is sooner, and less sure: it is told of, and slows nobody
(docs/safety.md, "Foresight").
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from iveg.domain.limits import LIMITS
from iveg.domain.rule.zones import Zone
from iveg.domain.tracking.person import Sighting, of_a_walker

_TURNED_M_S = 0.5
"""By so much a step differs from the smoothed velocity: less is a detector's noise."""
_LEAST_S = 0.1
"""Of two sightings that are closer to each other the way is mostly error."""


@dataclass(frozen=True, slots=True)
class LastStep:
    """How a chain of sightings went on last.

    Attributes:
        to: The sighting that it led to.
        vx: In ``map`` (m/s), of a walker at most; ``vy`` likewise.
    """

    to: Sighting
    vx: float
    vy: float


LastSteps = Mapping[int, LastStep]
"""By the number of the chain."""


def last_steps(zones: Iterable[Zone], before: LastSteps) -> LastSteps:
    """The newest step of everybody who has a ring, after those at the look before."""
    newest = (zone.sighting for zone in zones)
    return {
        one.chain: _step(one, before.get(one.chain))
        for one in newest
        if one is not None
    }


def turned(zone: Zone, steps: LastSteps) -> LastStep | None:
    """The newest step of whoever does not go on as before; None: they do."""
    seen = zone.sighting
    step = None if seen is None else steps.get(seen.chain)
    if seen is None or step is None:
        return None
    has_turned = math.hypot(step.vx - seen.vx, step.vy - seen.vy) >= _TURNED_M_S
    return step if has_turned else None


def _step(to: Sighting, before: LastStep | None) -> LastStep:
    """From the step before to a sighting of the same chain."""
    start = to if before is None else before.to
    after_s = to.at.mono - start.at.mono
    if before is not None and after_s < _LEAST_S:
        return before
    if before is None or after_s > LIMITS.seen_s or to.reach_m or start.reach_m:
        return LastStep(to, to.vx, to.vy)
    step = (to.x - start.x) / after_s, (to.y - start.y) / after_s
    return LastStep(to, *of_a_walker(*step))
