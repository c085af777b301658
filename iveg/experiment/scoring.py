"""Detections that came through the whole stack, against what was really in view.

Mistakes of a detector last: a person who is missed in one picture is missed in the next
twenty, too.  So what is counted is a second of one robot in which one target was in
view, found or not by the majority of its pictures, and a second in which something was
told that is not there.
"""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from statistics import fmean
from typing import Final

OVERLAP: Final = 0.5
"""Intersection over union from which on a box is right, as in AP@0.5."""
SIZE_M: Final = {"farmer": 0.5}
_ROBOT_SIZE_M = 1.0
_SAME_PICTURE_S = 0.06


@dataclass(frozen=True, slots=True)
class Seen:
    """A target in view, or a detection of one, by its centre in ``map`` (m).

    Attributes:
        key: Tells targets apart; of a detection its place in the picture.
        confidence: Of a detection (0 to 1).
    """

    key: str
    class_id: str
    x: float
    y: float
    confidence: float = 1.0


@dataclass(frozen=True, slots=True)
class Picture:
    """What one robot had in view, or said it had, at a moment (Unix s)."""

    robot_id: str
    at: float
    seen: tuple[Seen, ...]


@dataclass(frozen=True, slots=True)
class Score:
    """Of one class; ``ap`` is average precision at an overlap of one half."""

    tp: int = 0
    fp: int = 0
    fn: int = 0
    ap: float | None = None

    @property
    def precision(self) -> float | None:
        """0 to 1; None of nothing."""
        return self.tp / (self.tp + self.fp) if self.tp + self.fp else None

    @property
    def recall(self) -> float | None:
        """0 to 1; None of nothing."""
        return self.tp / (self.tp + self.fn) if self.tp + self.fn else None


@dataclass(slots=True)
class _Second:
    """One target, or one class of ghosts, for one second of one robot."""

    hits: list[float] = field(default_factory=list)
    looks: int = 0

    @property
    def is_found(self) -> bool:
        return 2 * len(self.hits) >= self.looks


@dataclass(frozen=True, slots=True)
class Tally:
    """Counted seconds of one class, from which scores of many runs can be added.

    Attributes:
        found: Mean confidence of each second in which a target was found.
        missed: How many seconds it was not.
        ghosts: Mean confidence of each second in which something was not there.
    """

    found: tuple[float, ...] = ()
    missed: int = 0
    ghosts: tuple[float, ...] = ()


def tally(
    truth: Iterable[Picture], told: Iterable[Picture]
) -> tuple[dict[str, Tally], int]:
    """Count each class, and how many pictures were compared."""
    views = _by_robot(truth)
    targets: dict[tuple[str, str, str, int], _Second] = defaultdict(_Second)
    ghosts: dict[tuple[str, str, int], _Second] = defaultdict(_Second)
    pictures: dict[tuple[str, int], int] = defaultdict(int)
    compared = 0
    for picture in told:
        real = _nearest(views.get(picture.robot_id, ()), picture.at)
        if real is None:
            continue
        compared += 1
        second = int(picture.at)
        pictures[picture.robot_id, second] += 1
        matched, wrong = match(real.seen, picture.seen)
        for target in real.seen:
            one = targets[picture.robot_id, target.class_id, target.key, second]
            one.looks += 1
            if target.key in matched:
                one.hits.append(matched[target.key])
        for ghost in wrong:
            ghosts[picture.robot_id, ghost.class_id, second].hits.append(
                ghost.confidence
            )
    for (robot_id, _, second), one in ghosts.items():
        one.looks = pictures[robot_id, second]
    return _tallies(targets, ghosts), compared


def match(
    real: Sequence[Seen], told: Sequence[Seen]
) -> tuple[dict[str, float], list[Seen]]:
    """Each target's own detection, the surest first, and what belongs to none."""
    matched: dict[str, float] = {}
    wrong: list[Seen] = []
    for one in sorted(told, key=lambda seen: -seen.confidence):
        free = [
            target
            for target in real
            if target.class_id == one.class_id and target.key not in matched
        ]
        best = max(free, key=lambda target: overlap(target, one), default=None)
        if best is None or overlap(best, one) < OVERLAP:
            wrong.append(one)
        else:
            matched[best.key] = one.confidence
    return matched, wrong


def overlap(real: Seen, told: Seen) -> float:
    """Intersection over union of two squares of the target's size at these centres."""
    size = SIZE_M.get(real.class_id, _ROBOT_SIZE_M)
    dx, dy = abs(real.x - told.x), abs(real.y - told.y)
    shared = max(0.0, size - dx) * max(0.0, size - dy)
    return shared / (2 * size * size - shared)


def score(tallies: Iterable[Tally]) -> Score:
    """One class over all runs."""
    all_of = list(tallies)
    found = [one for each in all_of for one in each.found]
    ghosts = [one for each in all_of for one in each.ghosts]
    missed = sum(each.missed for each in all_of)
    ap = _average_precision(found, ghosts, len(found) + missed)
    return Score(len(found), len(ghosts), missed, ap)


def _average_precision(
    found: Sequence[float], ghosts: Sequence[float], targets: int
) -> float | None:
    """Area under the precision envelope over recall (all points, as VOC since 2010)."""
    if targets == 0:
        return None
    ranked = sorted([(-one, 1) for one in found] + [(-one, 0) for one in ghosts])
    hits, precisions = 0, []
    for rank, (_, hit) in enumerate(ranked, 1):
        hits += hit
        precisions.append((hits / rank, hit))
    area, best = 0.0, 0.0
    for precision, hit in reversed(precisions):
        best = max(best, precision)
        area += best * hit / targets
    return area


def _tallies(
    targets: Mapping[tuple[str, str, str, int], _Second],
    ghosts: Mapping[tuple[str, str, int], _Second],
) -> dict[str, Tally]:
    classes = {key[1] for key in targets} | {key[1] for key in ghosts}
    out = {}
    for class_id in sorted(classes):
        seconds = [one for key, one in targets.items() if key[1] == class_id]
        wrong = [one for key, one in ghosts.items() if key[1] == class_id]
        out[class_id] = Tally(
            tuple(fmean(one.hits) for one in seconds if one.is_found and one.hits),
            sum(not one.is_found for one in seconds),
            tuple(fmean(one.hits) for one in wrong if one.is_found),
        )
    return out


def _by_robot(pictures: Iterable[Picture]) -> dict[str, list[Picture]]:
    out: dict[str, list[Picture]] = defaultdict(list)
    for one in pictures:
        out[one.robot_id].append(one)
    for views in out.values():
        views.sort(key=lambda one: one.at)
    return out


def _nearest(views: Sequence[Picture], at: float) -> Picture | None:
    """The picture of that moment; None where nobody wrote one down."""
    place = bisect_left(views, at, key=lambda one: one.at)
    near = views[max(0, place - 1) : place + 1]
    best = min(near, key=lambda one: abs(one.at - at), default=None)
    if best is None or abs(best.at - at) > _SAME_PICTURE_S:
        return None
    return best
