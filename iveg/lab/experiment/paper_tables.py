"""Numbers that the paper printed of its evaluation, and their contradictions.

The tables of YOLOx in simulation and in the field (``tab:yolo_metrics_sim``,
``tab:yolo_metrics_real2``), field by field; its two tables of latency are in
``domain/latency/paper``.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from statistics import fmean
from typing import Final

from iveg.domain.latency.paper import Place

CLASSES: Final = ("farmer", "AGI", "AGII")
COMPLETION: Final[Mapping[Place, float]] = {"simulation": 0.92, "field": 0.82}
"""Completed share of its runs."""
CONFIDENCE: Final[Mapping[Place, float]] = {"simulation": 0.85, "field": 0.72}
"""Mean confidence of its detector."""
P95_BELOW_MS: Final[Mapping[Place, float]] = {"simulation": 202.0, "field": 320.0}
"""P95 that it states for every kind of data from robot to Orion (ms)."""


@dataclass(frozen=True, slots=True)
class PaperScore:
    """One row: counts, then precision and recall in per cent, then AP@0.5."""

    tp: int
    fp: int
    fn: int
    precision: float
    recall: float
    ap: float | None


PRINTED: Final[Mapping[Place, Mapping[str, PaperScore]]] = {
    "simulation": {
        "farmer": PaperScore(42, 3, 1, 93.33, 97.67, 0.94),
        "AGI": PaperScore(18, 2, 2, 88.89, 92.52, 0.92),
        "AGII": PaperScore(28, 4, 3, 87.50, 87.56, 0.88),
    },
    "field": {
        "farmer": PaperScore(36, 6, 3, 85.71, 92.31, 0.94),
        "AGI": PaperScore(34, 8, 5, 80.95, 87.18, 0.88),
        "AGII": PaperScore(28, 12, 8, 70.00, 77.78, 0.88),
    },
}
GLOBAL: Final[Mapping[Place, PaperScore]] = {
    "simulation": PaperScore(88, 7, 6, 90.05, 92.70, None),
    "field": PaperScore(98, 26, 16, 79.03, 85.96, None),
}
"""Its row "Total (global)"."""
MEANS: Final[Mapping[Place, tuple[float, float, float]]] = {
    "simulation": (89.90, 92.58, 0.91),
    "field": (78.89, 85.76, 0.90),
}
"""Its row "Average (mean)": precision, recall (%), AP."""
_ROUNDING = 0.02


@dataclass(frozen=True, slots=True)
class Disagreement:
    """A printed number that does not follow from the numbers beside it."""

    place: Place
    row: str
    what: str
    printed: float
    follows: float


def disagreements() -> Iterator[Disagreement]:
    """Every such number of both tables: rates by rows, then totals and means."""
    for place, rows in PRINTED.items():
        for class_id, row in rows.items():
            yield from _rates(place, class_id, row)
        yield from _totals(place, list(rows.values()))
        yield from _rates(place, "total", GLOBAL[place])


def _rates(place: Place, name: str, row: PaperScore) -> Iterator[Disagreement]:
    rates = (
        ("precision %", row.precision, row.tp + row.fp),
        ("recall %", row.recall, row.tp + row.fn),
    )
    for what, printed, of in rates:
        follows = round(100.0 * row.tp / of, 2)
        if abs(follows - printed) > _ROUNDING:
            yield Disagreement(place, name, what, printed, follows)


def _totals(place: Place, rows: list[PaperScore]) -> Iterator[Disagreement]:
    total, means = GLOBAL[place], MEANS[place]
    totals = (
        ("total", "TP", total.tp, sum(row.tp for row in rows)),
        ("total", "FP", total.fp, sum(row.fp for row in rows)),
        ("total", "FN", total.fn, sum(row.fn for row in rows)),
        ("mean", "precision %", means[0], fmean(row.precision for row in rows)),
        ("mean", "recall %", means[1], fmean(row.recall for row in rows)),
    )
    for name, what, printed, follows in totals:
        if abs(follows - printed) > _ROUNDING:
            yield Disagreement(place, name, what, printed, round(follows, 2))


AGAINST_ITS_TEXT: Final = (
    "Five simulations in each of four scenarios are 20 runs; 18 completed are 90 %, "
    "not the 92 % that the text says.",
    "The text calls 90.05 % the global precision in simulation; 88 TP with the 7 FP of "
    "that row are 92.63 %, with the 9 FP of its rows 90.72 %. The loss of 11.02 % from "
    "simulation to field rests on it.",
    "The recalls of AGI and AGII are those of the classes that were looked for; the "
    "text reads them as recalls of the cameras that AGI and AGII carry.",
    "Total P95 is the sum of two P95, which is more than the P95 of the sums: what "
    "iVeg tells as total was measured from end to end.",
    "Δt₂ in the field rests on 598 polls of Orion, Δt₁ on more than 10,000 messages a "
    "kind of data.",
    "A detector with a mean confidence of 72 % is heard beneath the threshold of the "
    "text's own rule (0.8) most of the time: see the shares that reached it.",
)
"""Contradictions between the paper's tables and text (docs/experiment.md)."""
