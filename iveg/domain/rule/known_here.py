"""What lasers see again and again beside what the plan draws becomes "known here".

A plan that is off by 0.2 m, and plants that lean out, leave tips beyond what the plan
explains; each is seen now and then, whenever a robot passes.  So what counts is not a
long look but presence over time: seen in three visits or more over ten minutes, within
0.5 m of what is drawn, always at its place, by a robot that passed it (what moves with
a robot is nowhere as seen from it).

::

    seen ──> seen three times in ten minutes: known ──> told to robots near it
     ^          │ somebody within 1 m: neither counted nor told, until they walked off
     └──────────┘ in view; who was lost there, what moves there, or a place that is
                  seen empty: begun anew

What is learnt lasts until iVeg's next start at most: forgetting a place protects
(docs/safety.md, "Known here").
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from iveg.domain.geometry import Pose2D
from iveg.domain.known import (
    BESIDE_PLAN_M,
    LEARNT_RADIUS_M,
    MOST_TOLD,
    REACH_M,
    KnownPlace,
)
from iveg.domain.observations import Instant
from iveg.domain.obstacle import Obstacle
from iveg.domain.tracking.things import RADIUS_M, Thing, Things

LEARNS_S = 600.0
LEAST_VISITS = 3
_APART_S = 30.0
"""Between two visits: nobody passes a plant twice in less."""
_NEAR_M = 1.0
"""Of somebody: what is so near them may be them."""
_STILL_M, _SIZE_M = 0.25, 0.5
"""Where noise has the middle of a tip, and how large one is."""
_PASSED_M = 0.5
"""So far it is seen to go by, as the robot drives."""
_OFF_S = 2.0
"""Whoever walks off is seen again so soon; later it may be somebody else."""
_WALKED_S = 1.0
"""What moved so shortly ago may be near; so soon a laser tells who walks."""
_FORGOTTEN_S = 3600.0
MOST_KNOWN, MOST_SPOTS = 200, 1000
_ALIVE_S = 1.0
_TOLD_FOR_S = 0.5

_SWEPT_M, _EMPTY_S = 4.0, 3.0
"""So near a laser misses nothing of a person's size; so long, to be sure."""

Passes = Callable[[float, float], bool]
_Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Somebody:
    """Who is on the map.

    Attributes:
        person_id: None: a box that is too faint to be anybody.
        seen_at: When newest (monotonic, s).
        place: Where then, in ``map`` (m).
    """

    person_id: str | None
    seen_at: float
    place: _Place


@dataclass(frozen=True, slots=True)
class Around:
    """What may move.

    Attributes:
        people: Everybody on the map, and faint boxes.
        present: Where people are seen now, in ``map`` (m).
        moving: What a laser saw move.
    """

    people: Sequence[Somebody] = ()
    present: Sequence[_Place] = ()
    moving: Sequence[Obstacle] = ()


@dataclass(slots=True, eq=False)
class Spot:
    """Where something is seen from time to time.

    Attributes:
        x: Where it is in ``map`` (m), the mean of all looks; ``y`` likewise.
        since: When it was seen first since nobody was near; ``at`` newest.
        visits: How often, with half a minute in between.
        is_passed: Whether some robot saw it go by.
        known_since: When it became known; None: it is not.
        near: Who is near it, or was lost there, and when they were seen (monotonic, s).
        is_boxed: Whether a faint box shows somebody near it.
        is_doubtful: Whether something began to move there since it was seen.
        walked_by: When something moved near it (monotonic, s).
        first_beside: Where each robot saw it first in its ``base_link`` (m).
    """

    x: float
    y: float
    since: Instant
    at: Instant
    looks: int = 1
    visits: int = 1
    is_passed: bool = False
    known_since: Instant | None = None
    near: dict[str, float] = field(default_factory=dict)
    is_boxed: bool = False
    is_doubtful: bool = False
    walked_by: float = -math.inf
    first_beside: dict[str, tuple[float, float]] = field(default_factory=dict)

    def seen(self, robot_id: str, one: Obstacle, now: Instant) -> None:
        """Take one more look at it."""
        self.looks += 1
        self.is_doubtful = False
        self.x += (one.x - self.x) / self.looks
        self.y += (one.y - self.y) / self.looks
        self.visits += now.mono - self.at.mono >= _APART_S
        self.at = now
        self.pass_by(robot_id, one)

    def pass_by(self, robot_id: str, one: Obstacle) -> None:
        """Note where a robot has it; one that carries it has it at one place."""
        if not self.is_passed:
            first = self.first_beside.setdefault(robot_id, one.beside)
            if math.dist(first, one.beside) >= _PASSED_M:
                self.is_passed = True
                self.first_beside.clear()

    def is_disturbed(self, now: Instant) -> bool:
        """Whether somebody may be near it."""
        walked = now.mono - self.walked_by <= _WALKED_S
        return bool(self.near) or self.is_boxed or walked

    def may_be_told(self, now: Instant) -> bool:
        """Whether it is known, and stands there alone as far as anybody saw."""
        is_known = self.known_since is not None and not self.is_doubtful
        return is_known and not self.is_disturbed(now)

    def is_left_by(self, near: set[str], seen: Mapping[str | None, float]) -> bool:
        """Note who is near; whether somebody who was has not been seen to walk off."""
        lost = False
        for name, at in list(self.near.items()):
            if name not in near:
                lost |= seen.get(name, math.inf) - at > _OFF_S
                del self.near[name]
        self.near.update((name, seen[name]) for name in near)
        return lost

    @property
    def place(self) -> KnownPlace:
        """The circle that it explains."""
        return KnownPlace(self.x, self.y, LEARNT_RADIUS_M, BESIDE_PLAN_M)

    @property
    def is_learnt(self) -> bool:
        """Whether it was seen for long enough."""
        lasted = self.at.mono - self.since.mono >= LEARNS_S
        return lasted and self.visits >= LEAST_VISITS and self.is_passed


_Look = tuple[Spot | Thing, str]
"""What is seen to be empty, and by whom."""
_Told = tuple[float, tuple[Thing, ...], tuple[KnownPlace, ...]]
"""When a robot was told last (monotonic, s), by which marks, and of what."""


class KnownHere:
    """Learns places, forgets them, and tells robots of those near them."""

    def __init__(self, things: Things) -> None:
        self._things = things
        self._spots: list[Spot] = []
        self._empty: dict[_Look, float] = {}
        self._watched_at = -math.inf
        self._told: dict[str, _Told] = {}

    @property
    def known(self) -> Iterator[Spot]:
        """Every place that is known."""
        return (one for one in self._spots if one.known_since is not None)

    def learn(self, robot_id: str, seen: Iterable[Obstacle], now: Instant) -> None:
        """Learn what a laser that may be believed saw and nobody explained."""
        for one in seen:
            if _is_still(one):
                self._note(robot_id, one, now)

    def watch(self, around: Around, now: Instant) -> None:
        """Look who or what moves near places; of what nobody watches none is told."""
        self._watched_at = now.mono
        self._spots = [
            one for one in self._spots if now.mono - one.at.mono <= _FORGOTTEN_S
        ]
        seen = {one.person_id: one.seen_at for one in around.people}
        for spot, near in self._near(around.people):
            spot.is_boxed = None in near
            if spot.is_left_by({name for name in near if name}, seen):
                self._end(spot)
        self.stir(around.moving, now)
        self._end_marks(around.present, now)

    def _near(
        self, people: Sequence[Somebody]
    ) -> Iterator[tuple[Spot, set[str | None]]]:
        """Every place with the ids of those who are near it."""
        near: dict[int, set[str | None]] = {}
        spots = [(one.x, one.y) for one in self._spots]
        for index, who in _pairs(spots, [one.place for one in people], _NEAR_M):
            near.setdefault(index, set()).add(people[who].person_id)
        for index, spot in enumerate(tuple(self._spots)):
            yield spot, near.get(index, set())

    def stir(self, moving: Sequence[Obstacle], now: Instant) -> None:
        """Begin anew where something moved to; what walks is near.

        Whatever began to move there may have been it: it has to be seen again.
        """
        if not moving:
            return
        spots = [(one.x, one.y) for one in self._spots]
        begun = [(one.first_x, one.first_y) for one in moving]
        for index, _ in _pairs(spots, begun, LEARNT_RADIUS_M):
            self._spots[index].is_doubtful = True
        # Whoever walks is told from what is pushed within a second.
        moved = [
            (one.x, one.y)
            for one in moving
            if not one.is_somebody and one.at - one.since >= _WALKED_S
        ]
        ended = {index for index, _ in _pairs(spots, moved, LEARNT_RADIUS_M)}
        here = [(one.x, one.y) for one in moving]
        for index, _ in _pairs(spots, here, _NEAR_M):
            self._spots[index].walked_by = now.mono
        for spot in [self._spots[index] for index in ended]:
            self._end(spot)
        self._end_marks(here, now)

    def _end_marks(self, places: Sequence[_Place], now: Instant) -> None:
        """End the words of operators where somebody is, or something moves."""
        marks = self._things.obstacles_at(now)
        for index, _ in _pairs([(one.x, one.y) for one in marks], places, RADIUS_M):
            self._end(marks[index])

    def swept(self, robot_id: str, passes: Passes, pose: Pose2D, now: Instant) -> None:
        """End what a robot's laser has seen to be gone for some seconds.

        ``passes`` says whether every beam that something at a place would stop ends
        behind it; of what is far away that says too little.
        """
        empty: dict[_Look, float] = {}
        asked: list[Spot | Thing] = [*self.known, *self._things.obstacles_at(now)]
        for one in asked:
            near = pose.distance_to(one.x, one.y) <= _SWEPT_M
            if near and passes(one.x, one.y):
                look = one, robot_id
                empty[look] = self._empty.get(look, now.mono)
                if now.mono - empty[look] >= _EMPTY_S:
                    self._end(one)
        others = {
            look: at
            for look, at in self._empty.items()
            if look[1] != robot_id and now.mono - at <= 2 * _EMPTY_S
        }
        self._empty = others | empty

    def _end(self, one: Spot | Thing) -> None:
        if isinstance(one, Spot):
            self._spots.remove(one)
        else:
            self._things.moved(one.thing_id)
        self._told.clear()

    def near(self, robot_id: str, pose: Pose2D, now: Instant) -> tuple[KnownPlace, ...]:
        """Known places near a robot, the nearest first; none that nobody watches."""
        if now.mono - self._watched_at > _ALIVE_S:
            return ()
        marks = self._things.obstacles_at(now)
        at, whose, told = self._told.get(robot_id, (-math.inf, (), ()))
        if not 0.0 <= now.mono - at <= _TOLD_FOR_S or whose != tuple(marks):
            calm = (one.place for one in self._spots if one.may_be_told(now))
            told = _nearest((*(one.place for one in marks), *calm), pose)
            self._told[robot_id] = now.mono, tuple(marks), told
        return told

    def _note(self, robot_id: str, one: Obstacle, now: Instant) -> None:
        spot = min(
            self._spots,
            key=lambda spot: math.hypot(spot.x - one.x, spot.y - one.y),
            default=None,
        )
        if spot is None or math.hypot(spot.x - one.x, spot.y - one.y) > LEARNT_RADIUS_M:
            self._make_room()
            spot = Spot(one.x, one.y, now, now)
            spot.pass_by(robot_id, one)
            self._spots.append(spot)
            return
        if spot.is_disturbed(now):
            return
        spot.seen(robot_id, one, now)
        is_new = spot.known_since is None and spot.is_learnt
        if is_new and sum(1 for _ in self.known) < MOST_KNOWN:
            spot.known_since = now
            self._told.clear()

    def _make_room(self) -> None:
        if len(self._spots) >= MOST_SPOTS:
            self._spots.remove(min(self._spots, key=lambda one: one.at.mono))


def _is_still(one: Obstacle) -> bool:
    """Whether it may be the tip of a plant, or a part of what is drawn elsewhere."""
    return (
        one.counts
        and not one.is_somebody
        and one.most_way_m <= _STILL_M
        and one.size_m <= _SIZE_M
        and one.out_m <= BESIDE_PLAN_M
    )


def _nearest(places: Iterable[KnownPlace], pose: Pose2D) -> tuple[KnownPlace, ...]:
    away = [(pose.distance_to(one.x, one.y), one) for one in places]
    near = sorted((one for one in away if one[0] <= REACH_M), key=lambda one: one[0])
    return tuple(one for _, one in near[:MOST_TOLD])


def _pairs(
    places: Sequence[_Place], others: Sequence[_Place], within_m: float
) -> list[tuple[int, int]]:
    """Which of the places are near which of the others."""
    if not places or not others:
        return []
    apart = np.array(places)[:, None] - np.array(others)[None]
    near = np.argwhere(np.hypot(apart[..., 0], apart[..., 1]) <= within_m)
    return [(int(one), int(other)) for one, other in near]
