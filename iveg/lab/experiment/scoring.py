"""Reported detections compared with the ground truth, frame by frame.

As in the paper a detector is scored by its own picture, in the frame of its robot: an
error of the robot's pose is none of its detector.

Errors of a detector persist: a person missed in one frame is missed in the next twenty
as well.  So frames are counted, but the confidence interval of a rate uses the number
of *looks*: two seconds of one robot at one target, as long as an error lasts.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import sqrt
from statistics import fmean
from typing import Final

import numpy as np

_Z: Final = 1.959964
"""Normal quantile for 95 %."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A share with its 95 % interval; all 0 to 1."""

    share: float
    low: float
    high: float


def wilson(hits: float, count: float) -> Interval | None:
    """The Wilson score interval (Wilson 1927); None without data."""
    if count <= 0:
        return None
    share, z2 = hits / count, _Z * _Z
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    spread = sqrt(share * (1 - share) / count + z2 / (4 * count * count))
    half = _Z / (1 + z2 / count) * spread
    return Interval(share, max(0.0, middle - half), min(1.0, middle + half))


def thinned(hits: int, count: int, worth: int) -> Interval | None:
    """The interval where ``count`` trials are worth only ``worth`` independent ones."""
    return wilson(hits * worth / count, worth) if count and worth else None


OVERLAP: Final = 0.5
"""Least intersection over union of a correct box, as in AP@0.5."""
SIZE_M: Final = {"farmer": 0.5}
_ROBOT_SIZE_M = 1.0
_LOOK_S = 2.0
"""Longest duration of one error of the emulated detector (s)."""


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
        precision: With its interval; ``recall`` likewise.
        ap: Average precision at an overlap of one half.
        confidence: Mean over the detections of targets.
    """

    tp: int
    fp: int
    fn: int
    precision: Interval | None
    recall: Interval | None
    ap: float | None
    confidence: float | None


@dataclass(slots=True)
class Tally:
    """Counts of one class, from which scores of many runs can be added.

    Attributes:
        found: Confidence of each reported detection of a target.
        missed: Number of frames with a target in view but not reported.
        ghosts: Confidence of each detection without a target.
        looks: Looks at targets; ``claims``: looks with a reported detection.  Both
            are effective sample sizes, as frames of one look are not independent.
    """

    found: list[float] = field(default_factory=list)
    missed: int = 0
    ghosts: list[float] = field(default_factory=list)
    looks: int = 0
    claims: int = 0


def tally(pairs: Iterable[Pair]) -> dict[str, Tally]:
    """Count each class."""
    counts: dict[str, Tally] = defaultdict(Tally)
    looks: dict[str, set[object]] = defaultdict(set)
    claims: dict[str, set[object]] = defaultdict(set)
    for real, reported in pairs:
        look = real.robot_id, int(real.at // _LOOK_S)
        matched, wrong = match(real.seen, reported.seen)
        for target in real.seen:
            name = target.class_id
            looks[name].add((target.key, look))
            if target.key in matched:
                counts[name].found.append(round(matched[target.key].confidence, 4))
                claims[name].add((target.key, look))
            else:
                counts[name].missed += 1
        for ghost in wrong:
            counts[ghost.class_id].ghosts.append(round(ghost.confidence, 4))
            claims[ghost.class_id].add(("", look))
    for name, count in counts.items():
        count.looks, count.claims = len(looks[name]), len(claims[name])
    return dict(sorted(counts.items()))


def match(
    real: Sequence[SeenObject], reported: Sequence[SeenObject]
) -> tuple[dict[str, SeenObject], list[SeenObject]]:
    """Detection of each target, most confident first, and unmatched detections."""
    matched: dict[str, SeenObject] = {}
    wrong: list[SeenObject] = []
    for one in sorted(reported, key=lambda seen: -seen.confidence):
        free = [
            target
            for target in real
            if target.class_id == one.class_id and target.key not in matched
        ]
        best = max(free, key=lambda target: overlap(target, one), default=None)
        if best is None or overlap(best, one) < OVERLAP:
            wrong.append(one)
        else:
            matched[best.key] = one
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
        total.looks += tally_.looks
        total.claims += tally_.claims
    tp, fp, fn = len(total.found), len(total.ghosts), total.missed
    return Score(
        tp,
        fp,
        fn,
        precision=thinned(tp, tp + fp, total.claims),
        recall=thinned(tp, tp + fn, total.looks),
        ap=average_precision(total.found, total.ghosts, tp + fn),
        confidence=fmean(total.found) if total.found else None,
    )


def average_precision(
    found: Sequence[float], ghosts: Sequence[float], targets: int
) -> float | None:
    """Area under the precision envelope over recall (all points, as VOC since 2010)."""
    if targets == 0:
        return None
    is_hit = np.repeat((1, 0), (len(found), len(ghosts)))
    # Of equally sure ones those of nothing rank first.
    is_hit = is_hit[np.lexsort((is_hit, -np.array([*found, *ghosts])))]
    precision = np.cumsum(is_hit) / np.arange(1, len(is_hit) + 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1]
    return float((envelope * is_hit).sum() / targets)
