"""Reported detections compared with the ground truth, frame by frame.

As in the paper a detector is scored by its own picture, in the frame of its robot: an
error of the robot's pose is none of its detector.

Frames are counted, though errors of a detector persist: a person missed in one frame is
missed in the next twenty as well.  So frames are far more than independent samples.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from statistics import fmean
from typing import Final

import numpy as np

OVERLAP: Final = 0.5
"""Least intersection over union of a correct box, as in AP@0.5."""
SIZE_M: Final = {"farmer": 0.5}
_ROBOT_SIZE_M = 1.0


@dataclass(frozen=True, slots=True)
class SeenObject:
    """A target in view, or a detection of one, by its centre in ``base_link`` (m).

    Attributes:
        key: Id of a target; of a detection its index in the frame.
        confidence: Confidence of a detection (0 to 1).
    """

    key: str
    class_id: str
    x: float
    y: float
    confidence: float = 1.0


@dataclass(frozen=True, slots=True)
class Picture:
    """Targets that one robot had in view, or reported, at a moment (Unix s)."""

    robot_id: str
    at: float
    seen: tuple[SeenObject, ...]


Pair = tuple[Picture, Picture]
"""One detection frame: the targets in view, and the reported detections."""


@dataclass(frozen=True, slots=True)
class Score:
    """Score of one class, or of several together.

    Attributes:
        precision: None without a detection; ``recall``: None without a target.
        ap: Average precision at an overlap of one half.
        confidence: Mean over the detections of targets.
    """

    tp: int
    fp: int
    fn: int
    precision: float | None
    recall: float | None
    ap: float | None
    confidence: float | None


@dataclass(slots=True)
class Tally:
    """Counts of one class, from which scores of many runs can be added.

    Attributes:
        found: Confidence of each reported detection of a target.
        missed: Number of frames with a target in view but not reported.
        ghosts: Confidence of each detection without a target.
    """

    found: list[float] = field(default_factory=list)
    missed: int = 0
    ghosts: list[float] = field(default_factory=list)


def tally(pairs: Iterable[Pair]) -> dict[str, Tally]:
    """Count each class."""
    counts: dict[str, Tally] = defaultdict(Tally)
    for real, reported in pairs:
        matched, wrong = match(real.seen, reported.seen)
        for target in real.seen:
            count = counts[target.class_id]
            if target.key in matched:
                count.found.append(round(matched[target.key].confidence, 4))
            else:
                count.missed += 1
        for ghost in wrong:
            counts[ghost.class_id].ghosts.append(round(ghost.confidence, 4))
    return dict(sorted(counts.items()))


def match(
    real: Sequence[SeenObject], reported: Sequence[SeenObject]
) -> tuple[dict[str, SeenObject], list[SeenObject]]:
    """Detection of each target, most confident first, and unmatched detections."""
    matched: dict[str, SeenObject] = {}
    wrong: list[SeenObject] = []
    # As VOC does: a sure detection takes its target before an unsure one can.
    for detection in sorted(reported, key=lambda box: -box.confidence):
        free = [
            (overlap(target, detection), target.key)
            for target in real
            if target.class_id == detection.class_id and target.key not in matched
        ]
        best, key = max(free, key=itemgetter(0), default=(0.0, ""))
        if best < OVERLAP:
            wrong.append(detection)
        else:
            matched[key] = detection
    return matched, wrong


def overlap(real: SeenObject, reported: SeenObject) -> float:
    """Intersection over union of two squares of the target's size at these centres."""
    size = SIZE_M.get(real.class_id, _ROBOT_SIZE_M)
    along = max(0.0, size - abs(real.x - reported.x))
    across = max(0.0, size - abs(real.y - reported.y))
    shared = along * across
    return shared / (2 * size * size - shared)


def score(tallies: Iterable[Tally]) -> Score:
    """Add up tallies, of one class over all runs or of several classes."""
    total = Tally()
    for tally_ in tallies:
        total.found += tally_.found
        total.ghosts += tally_.ghosts
        total.missed += tally_.missed
    tp, fp, fn = len(total.found), len(total.ghosts), total.missed
    return Score(
        tp,
        fp,
        fn,
        precision=tp / (tp + fp) if tp + fp else None,
        recall=tp / (tp + fn) if tp + fn else None,
        ap=average_precision(total.found, total.ghosts, tp + fn),
        confidence=fmean(total.found) if total.found else None,
    )


def average_precision(
    hits: Sequence[float], ghosts: Sequence[float], targets: int
) -> float | None:
    """Area under the precision envelope over recall (all points, as VOC since 2010)."""
    if targets == 0:
        return None
    is_hit = np.repeat((1, 0), (len(hits), len(ghosts)))
    # Ghosts first among equals: the order of files may not make a detector better.
    is_hit = is_hit[np.lexsort((is_hit, -np.array([*hits, *ghosts])))]
    precision = np.cumsum(is_hit) / np.arange(1, len(is_hit) + 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1]
    return float((envelope * is_hit).sum() / targets)
