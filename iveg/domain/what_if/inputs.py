"""What the history keeps of the rule's inputs, as arrays.

Two poses a second and robot, two detections a second of each subject, faint ones among
them.  No plans, tasks or scans: who drives is taken to drive on, nobody gives way by
their task, and what lasers saw is no part of it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iveg.domain.limits import LIMITS
from iveg.domain.tracking.calibration import logit
from iveg.domain.tracking.looks import FAINT_FROM, FORGOTTEN_S, SUREST
from iveg.domain.tracking.person import of_a_walker

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]
_SMOOTHED_S = 0.4


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses of one robot, oldest first; each of shape (n,).

    Attributes:
        at: Unix seconds; x, y in ``map`` (m), yaw (rad), linear (m/s), angular (rad/s).
    """

    at: Floats
    x: Floats
    y: Floats
    yaw: Floats
    linear: Floats
    angular: Floats


@dataclass(frozen=True, slots=True)
class Sightings:
    """Detections of people and strange robots, by chain and time; each of shape (n,).

    A chain is one subject as one robot saw it.

    Attributes:
        vx: How the chain goes in ``map`` (m/s); ``vy`` likewise.
        probability: Of the box alone, 0 to 1.
        belief: The greatest threshold by which it would count, looks added up (0 to 1).
        chain: Its number; ``subject`` likewise, the same for all who saw it.
        is_person: Else a robot that is not of the fleet.
        counted: The rule of then took it.
    """

    at: Floats
    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    probability: Floats
    belief: Floats
    chain: Indices
    subject: Indices
    is_person: Flags
    counted: Flags


@dataclass(frozen=True, slots=True)
class Inputs:
    """All of it.

    Attributes:
        braking: What each robot's brakes can do (m/s²).
    """

    poses: Mapping[str, Poses]
    sightings: Sightings
    braking: Mapping[str, float]


PoseRow = Sequence[float]
"""When, x, y, yaw, linear, angular."""
SeenRow = tuple[str, float, float, float, float, str, str | None]
"""Robot, when, x, y, probability, class, person."""


def poses_of(rows: Iterable[PoseRow]) -> Poses:
    """Rows of one robot in order of time."""
    numbers = np.fromiter(chain.from_iterable(rows), np.float64).reshape(-1, 6)
    return Poses(*numbers.T.copy())


def sightings_of(rows: Sequence[SeenRow]) -> Sightings:
    """Rows in order of time, joined to chains."""
    chains = _Chains()
    found = [chains.join(row) for row in rows]
    numbers = np.array(
        [
            (*row[1:5], max(row[4], one.belief), one.number, one.subject)
            for row, one in zip(rows, found, strict=True)
        ],
        np.float64,
    ).reshape(-1, 7)
    flags = np.array(
        [(row[5] == "person", row[6] is not None) for row in rows], np.bool_
    ).reshape(-1, 2)
    order = np.lexsort((numbers[:, 0], numbers[:, 5]))
    at, x, y, probability, belief, link, subject = numbers[order].T.copy()
    vx, vy = _velocities(at, x, y, link)
    links, who = link.astype(np.intp), subject.astype(np.intp)
    person, counted = flags[order].T.copy()
    return Sightings(at, x, y, vx, vy, probability, belief, links, who, person, counted)


class _Chain(NamedTuple):
    """The newest of a chain.

    Attributes:
        odds: Log-odds of all looks at it, as ``tracking.looks`` adds them up;
            ``looks`` how many, since the last second without any.
        belief: The greatest threshold that looks have reached.
    """

    number: int
    subject: int
    at: float
    x: float
    y: float
    odds: float
    looks: int
    belief: float


class _Chains:
    """The chains of all observers."""

    def __init__(self) -> None:
        self._subjects: dict[object, int] = {}
        self._newest: dict[tuple[str, str], dict[int, _Chain]] = {}
        self._count = 0

    def join(self, row: SeenRow) -> _Chain:
        """The chain of a detection, with it as its newest."""
        robot, at, x, y, probability, class_, person = row
        of = self._newest.setdefault((robot, class_), {})
        before = _nearest(of, at, x, y, self._subjects.get(person))
        if before is None:
            self._count += 1
        number = self._count if before is None else before.number
        subject = self._subject(person, before, number)
        odds, looks, belief = _believed(before, at, probability, class_)
        of[number] = _Chain(number, subject, at, x, y, odds, looks, belief)
        return of[number]

    def _subject(self, person: str | None, before: _Chain | None, number: int) -> int:
        if person is None and before is not None:
            return before.subject
        name = number if person is None else person
        return self._subjects.setdefault(name, len(self._subjects))


def _nearest(
    of: dict[int, _Chain], at: float, x: float, y: float, subject: int | None
) -> _Chain | None:
    """The chain that goes on here: of the same subject, else the nearest in reach."""
    for gone in [one.number for one in of.values() if at - one.at > _LASTS_S]:
        del of[gone]
    found: tuple[bool, float, _Chain] | None = None
    for one in of.values():
        apart = math.hypot(one.x - x, one.y - y)
        within = min(_GATE_CAP_M, _GATE_M + LIMITS.walking_m_s * (at - one.at))
        rank = one.subject != subject, apart, one
        if one.at < at and apart <= within and (found is None or rank < found):
            found = rank
    return None if found is None else found[2]


_LASTS_S = LIMITS.ring_lasts_s
_GATE_M, _GATE_CAP_M = 1.0, 2.0


def _believed(
    before: _Chain | None, at: float, probability: float, class_: str
) -> tuple[float, int, float]:
    """Odds, number of looks and belief of a chain with one detection more.

    Pictures without it leave no row, so what those cost is not known.
    """
    is_look = class_ == "person" and probability >= FAINT_FROM
    if before is None or at - before.at > FORGOTTEN_S:
        return (logit(probability) if is_look else 0.0), int(is_look), probability
    if not is_look:
        return before.odds, before.looks, max(before.belief, probability)
    odds, looks = min(SUREST, before.odds + logit(probability)), before.looks + 1
    together = 1 / (1 + math.exp(-odds)) if looks > 1 else 0.0
    return odds, looks, max(before.belief, probability, together)


def _velocities(at: Floats, x: Floats, y: Floats, of: Floats) -> tuple[Floats, Floats]:
    """Of each chain (m/s), smoothed as the tracker does, of a walker at most."""
    found = np.zeros((len(at), 2))
    after = np.diff(at)
    goes_on = (np.diff(of) == 0) & (after > 0.0) & (after <= LIMITS.seen_s)
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.column_stack((np.diff(x) / after, np.diff(y) / after))
        gains = after / (_SMOOTHED_S + after)
    vx = vy = 0.0
    # Each from the one before: numbers of Python are faster here than arrays.
    each = zip(goes_on.tolist(), gains.tolist(), steps.tolist(), strict=True)
    for row, (is_next, gain, (to_x, to_y)) in enumerate(each, 1):
        if not is_next:
            vx = vy = 0.0
            continue
        vx, vy = of_a_walker(vx + gain * (to_x - vx), vy + gain * (to_y - vy))
        found[row] = vx, vy
    return found[:, 0], found[:, 1]
