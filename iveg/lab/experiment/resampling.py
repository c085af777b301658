"""Change of a number between two experiments, by drawing whole runs.

What happens within one run is not independent, and neither is its load of the machine:
so runs are drawn with replacement (Efron 1979), those of the same seeds in pairs.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from iveg.domain.records import Json
from iveg.lab.experiment.paper_tables import CLASSES
from iveg.lab.experiment.scoring import average_precision
from iveg.lab.experiment.statistics import FEWEST_RUNS, Interval

Run = Json
"""One half of a run, as ``outcome.half_of`` has it."""
Number = Callable[[Sequence[Run]], float | None]
"""Of some runs together; None where there is nothing to count."""
_DRAWS: Final = 400
_SEED: Final = 14


@dataclass(frozen=True, slots=True)
class Measure:
    """A number of runs.

    Attributes:
        better: 1.0 where more is better, -1.0 where less is; 0.0: neither.
    """

    name: str
    of: Number
    better: float = 1.0


def measures() -> Iterator[Measure]:
    """Numbers of what robots did, without times."""
    for class_id in CLASSES:
        yield Measure(f"{class_id} AP", _precision((class_id,)))
    yield Measure("total AP", _precision(CLASSES))
    yield Measure("slow-downs a run", _mean("slowdowns", "decided"), 0.0)
    yield Measure("slow-downs applied", _share("slowdowns", "applied", "decided"))
    yield Measure("slow-downs out of sight", _mean("slowdowns", "out_of_sight"), 0.0)
    yield Measure("injected", _share("injection", "injected", "asked"))
    yield Measure("injected before seen", _share("injection", "ahead", "people"))


def protection_measures() -> Iterator[Measure]:
    """Numbers of people near moving robots."""
    yield Measure("slowed near people in view", _slowed(("in_view",)))
    yield Measure("slowed near people", _slowed(("in_view", "behind_plants", "unseen")))
    yield Measure("encounters never slowed", _never_slowed, -1.0)
    yield Measure("needless > 4 m", _needless, -1.0)


def change(
    before: Sequence[Run], after: Sequence[Run], number: Number, *, paired: bool
) -> tuple[float, float, Interval] | None:
    """A number before and after, and its 95 % interval of the difference.

    Args:
        before: Runs of one experiment.
        after: Runs of the other.
        number: What is compared.
        paired: The runs have the same seeds, in the same order.

    Returns:
        None: too few runs, or nothing to count.
    """
    was, now = number(before), number(after)
    if was is None or now is None or min(len(before), len(after)) < FEWEST_RUNS:
        return None
    rng = np.random.default_rng(_SEED)
    apart = []
    for _ in range(_DRAWS):
        old = rng.integers(len(before), size=len(before))
        new = old if paired else rng.integers(len(after), size=len(after))
        one, other = (
            number([runs[n] for n in drawn])
            for runs, drawn in ((before, old), (after, new))
        )
        if one is not None and other is not None:
            apart.append(other - one)
    low, high = np.percentile(apart, (2.5, 97.5))
    return was, now, Interval(now - was, float(low), float(high))


def _precision(classes: Sequence[str]) -> Number:
    def number(runs: Sequence[Run]) -> float | None:
        tallies = [
            run["classes"][c] for run in runs for c in classes if c in run["classes"]
        ]
        found = [sure for one in tallies for sure in one["found"]]
        ghosts = [sure for one in tallies for sure in one["ghosts"]]
        missed = sum(one["missed"] for one in tallies)
        return average_precision(found, ghosts, len(found) + missed)

    return number


def _share(what: str, part: str, whole: str) -> Number:
    return lambda runs: _ratio(
        sum(run[what].get(part, 0) for run in runs),
        sum(run[what].get(whole, 0) for run in runs),
    )


def _mean(what: str, part: str) -> Number:
    return lambda runs: _ratio(sum(run[what].get(part, 0) for run in runs), len(runs))


def _slowed(sights: Sequence[str]) -> Number:
    def number(runs: Sequence[Run]) -> float | None:
        slowed, near = (
            sum(run["protection"][key][one] for run in runs for one in sights)
            for key in ("slowed_s", "near_s")
        )
        return _ratio(slowed, near)

    return number


def _never_slowed(runs: Sequence[Run]) -> float | None:
    delays = [one for run in runs for one in run["protection"]["delays_s"]]
    return _ratio(delays.count(None), len(delays))


def _needless(runs: Sequence[Run]) -> float | None:
    spent = sum(run["protection"]["needless_s"]["4"] for run in runs)
    return _ratio(spent, sum(run["protection"]["driven_s"] for run in runs))


def _ratio(part: float, whole: float) -> float | None:
    return part / whole if whole else None
