"""What the paper printed of its detector, and where its tables contradict themselves.

The tables of YOLOx in simulation and in the field (``tab:yolo_metrics_sim``,
``tab:yolo_metrics_real2``), field by field.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from iveg.domain.latency.paper import Place

CLASSES: Final = ("farmer", "AGI", "AGII")
COMPLETION_RATE: Final = 0.82
"""Of its runs in the field."""


@dataclass(frozen=True, slots=True)
class Printed:
    """One row: counts, then precision and recall in per cent, then AP@0.5."""

    tp: int
    fp: int
    fn: int
    precision: float
    recall: float
    ap: float


PRINTED: Final[dict[Place, dict[str, Printed]]] = {
    "simulation": {
        "farmer": Printed(42, 3, 1, 93.33, 97.67, 0.94),
        "AGI": Printed(18, 2, 2, 88.89, 92.52, 0.92),
        "AGII": Printed(28, 4, 3, 87.50, 87.56, 0.88),
    },
    "field": {
        "farmer": Printed(36, 6, 3, 85.71, 92.31, 0.94),
        "AGI": Printed(34, 8, 5, 80.95, 87.18, 0.88),
        "AGII": Printed(28, 12, 8, 70.00, 77.78, 0.88),
    },
}
_ROUNDING = 0.02


@dataclass(frozen=True, slots=True)
class Disagreement:
    """A rate that does not follow from the counts beside it (per cent)."""

    place: Place
    class_id: str
    rate: str
    printed: float
    follows: float


def disagreements() -> Iterator[Disagreement]:
    """Every such rate of both tables."""
    for place, rows in PRINTED.items():
        for class_id, row in rows.items():
            rates = (
                ("precision", row.precision, row.tp + row.fp),
                ("recall", row.recall, row.tp + row.fn),
            )
            for rate, printed, of in rates:
                follows = round(100.0 * row.tp / of, 2)
                if abs(follows - printed) > _ROUNDING:
                    yield Disagreement(place, class_id, rate, printed, follows)
