"""How sure one look makes, by detector and class (docs/safety.md, "Calibration").

A detector's confidence is its own number: two detectors that say 0.72 are not right
equally often.  A row takes it to log-odds by what somebody counted (Platt 1999, with
the slope fixed at one)::

    log-odds of a look = logit(confidence) + offset
    offset = log(right / wrong) - logit(mean confidence of the boxes counted)

Rows change what looks add up to, and nothing else: a box at the threshold counts as
the detector tells it (Algorithm 2).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from iveg.domain.parameters import Class

ANY = ""
"""Stands for every detector that has no row of its own."""
FARTHEST = 3.0
"""Bound of an offset: of twenty boxes one is right, or one wrong, at an even word."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """One row.

    Attributes:
        offset: Added to the log-odds that the detector tells.
    """

    offset: float = 0.0

    @classmethod
    def of_counts(cls, right: int, wrong: int, mean: float) -> "Calibration":
        """The row of boxes that somebody compared with the truth.

        Args:
            right: So many showed what they said.
            wrong: So many did not.  Half a box is added to both (Haldane 1956), so that
                nothing is certain.
            mean: Mean confidence of all of them (0 to 1, exclusive).
        """
        offset = math.log((right + 0.5) / (wrong + 0.5)) - logit(mean)
        return cls(min(FARTHEST, max(-FARTHEST, offset)))

    def log_odds(self, confidence: float) -> float:
        """Of one look (confidence 0 to 1)."""
        return logit(confidence) + self.offset


PLAIN = Calibration()
"""The confidence as the detector tells it."""


@dataclass(frozen=True, slots=True)
class Calibrations:
    """The rows, by detector (``ANY``: the others) and class; without one: ``PLAIN``."""

    rows: Mapping[tuple[str, Class], Calibration] = field(default_factory=dict)

    def row_of(self, detector: str | None, class_: Class) -> Calibration:
        """The row for a detector's name, as its frames tell it."""
        own = self.rows.get((detector or ANY, class_))
        return own or self.rows.get((ANY, class_), PLAIN)


def logit(probability: float) -> float:
    """Log-odds, of at least 0.01 and at most 0.99."""
    bounded = min(max(probability, 0.01), 0.99)
    return math.log(bounded / (1.0 - bounded))
