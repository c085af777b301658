"""Error models of detectors: what they miss, invent and misplace.

Source of the rates: the seed paper's field table (true positives, false positives,
false negatives per class).  Assumed: the spread of confidence, and that false boxes
are less sure than true ones.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

PERSON = "farmer"


@dataclass(frozen=True, slots=True)
class Counts:
    """Counts of one class in the paper's field table."""

    true_positives: int
    false_positives: int
    false_negatives: int

    @property
    def encounters(self) -> int:
        """Number of encounters with a target of the class."""
        return self.true_positives + self.false_negatives

    @property
    def miss_rate(self) -> float:
        """Probability that an encounter is missed."""
        return self.false_negatives / self.encounters

    @property
    def ghost_rate(self) -> float:
        """Probability that an encounter brings a false box of the class."""
        return self.false_positives / self.encounters


FIELD_COUNTS: Mapping[str, Counts] = {
    PERSON: Counts(36, 6, 3),
    "AGI": Counts(34, 8, 5),
    "AGII": Counts(28, 12, 8),
}


_FAULTLESS = Counts(1, 0, 0)


@dataclass(frozen=True, slots=True)
class DetectorModel:
    """Error model of a detector.

    Attributes:
        confidence: Mean over encounters (0 to 1); ``spread`` its deviation.
        flicker: Deviation from frame to frame.
        ghost_confidence: How much less sure false boxes are.
        position: Deviation of a box for an encounter (m); ``jitter`` per frame (m).
        counts: By class; other classes have the counts of ``AGI``.
        name: As its frames tell it; None: they do not.
    """

    confidence: float
    spread: float = 0.05
    flicker: float = 0.01
    ghost_confidence: float = 0.10
    position: float = 0.05
    jitter: float = 0.01
    counts: Mapping[str, Counts] = field(default_factory=lambda: FIELD_COUNTS)
    name: str | None = None

    def counts_of(self, class_id: str) -> Counts:
        """The rates for a class."""
        return self.counts.get(class_id, self.counts.get("AGI", _FAULTLESS))


DETECTORS: Mapping[str, DetectorModel] = {
    "field": DetectorModel(0.72, name="field"),
    "simulation": DetectorModel(0.85, spread=0.03, name="simulation"),
    "noisy": DetectorModel(0.80, 0.06, 0.06, 0.0, 0.10, 0.05, {}),
    "perfect": DetectorModel(0.95, 0.0, 0.0, 0.0, 0.0, 0.0, {}),
}
