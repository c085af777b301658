"""What goes wrong in the field test: navigation gives up, and links have gaps.

Rates are set by us, as the paper tells none: it says that 92 % of its simulated runs
were completed and 82 % in the field, not why the others were not; and that no message
was lost in simulation, so that links have gaps in the field alone.  They were chosen
near these shares: of minutes with two robots 96 % (simulation) and about 81 % (field)
pass without a failure.  What detectors miss comes on top and is measured.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.scripts import Incident

LINK_LOST_S: Final = 5.0
"""A robot that iVeg has not heard for so long has left the fleet: the run failed."""


@dataclass(frozen=True, slots=True)
class FailureModel:
    """How often things go wrong, per robot and minute.

    Attributes:
        gives_up: Navigation gives up, for the rest of the run.
        gaps: The link has a gap; ``gap_s`` long on average (exponential, s).
    """

    gives_up: float
    gaps: float
    gap_s: float = 2.0


FAILURES: Final[Mapping[str, FailureModel]] = {
    "simulation": FailureModel(0.02, 0.0),
    "field": FailureModel(0.04, 0.6),
}
"""By detector profile."""


def drawn(
    model: FailureModel, robots: Sequence[str], seconds: float, seed: int
) -> tuple[Incident, ...]:
    """The incidents of one run; the same seed gives the same ones."""
    rng = np.random.default_rng((seed, len(robots)))
    found = [one for robot in robots for one in _of_robot(model, robot, seconds, rng)]
    return tuple(sorted(found, key=lambda one: one.at_s))


def _of_robot(
    model: FailureModel, robot: str, seconds: float, rng: np.random.Generator
) -> Iterator[Incident]:
    for at_s in _moments(model.gives_up, seconds, rng):
        yield Incident(at_s, FaultOrder(robot=robot, stuck=True))
    free_at = 0.0
    for at_s in _moments(model.gaps, seconds, rng):
        ends_s = at_s + rng.exponential(model.gap_s)
        # A gap within another one is the same.
        if at_s >= free_at:
            yield Incident(at_s, FaultOrder(robot=robot, mute=True))
            yield Incident(ends_s, FaultOrder(robot=robot, mute=False))
            free_at = ends_s


def _moments(
    per_minute: float, seconds: float, rng: np.random.Generator
) -> Sequence[float]:
    """Moments of a Poisson process (s), in order."""
    count = rng.poisson(per_minute * seconds / 60.0)
    return sorted(float(one) for one in rng.uniform(0.0, seconds, count))
