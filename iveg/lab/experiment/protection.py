"""Protection of people near a moving robot, scored against the truth.

Only the truth counts: true places of robots and people, true views of cameras, and the
speed that a robot's own safety machine allows.  Of iVeg itself only the time at which
it published an encounter counts.

*Near* is within two metres of a robot that moves; an *encounter* is one robot near one
person in view of some camera, without a pause of a second; its *delay* is the time
from there until the robot is limited to half speed.  An *entry* is the moment at which
a robot and the zone of a person meet, if the person has been in view for two seconds:
later glimpses leave no time to slow before.

A person is in view where the newest picture of some robot has them, if it is not older
than a quarter of a second: robots take theirs at different times.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, groupby
from math import dist, inf
from operator import attrgetter, itemgetter
from statistics import quantiles
from typing import Final, Literal, get_args

from iveg.domain.feedback import HALF_SPEED
from iveg.domain.records import Json
from iveg.lab.experiment.stage import Row

Sight = Literal["in_view", "unseen"]
"""Whether in view of some camera."""
SIGHTS: Final[tuple[Sight, ...]] = get_args(Sight)
NEAR_M = 2.0
"""The zone of the rule (m)."""
AWAY_M = 4.0
"""A limit with nobody this near is needless (m)."""
MOVES_M_S = 0.05
AHEAD_S = 1.5
"""Lead that a published encounter should have over the entry (s)."""
ROUNDING_S = 1e-6


@dataclass(frozen=True, slots=True)
class NearPerson:
    """A person near one robot.

    Attributes:
        distance_m: From the robot's ``base_link`` to the person.
        has_encounter: iVeg publishes an encounter of this robot with the person.
    """

    name: str
    distance_m: float
    sight: Sight
    has_encounter: bool = False


@dataclass(frozen=True, slots=True)
class NearMoment:
    """One robot at one moment.

    Attributes:
        at: (s); ``lasts_s`` for how long it counts.
        speed: True speed (m/s).
        wanted: Speed that it would drive without limits (m/s).
        factor: Greatest speed factor that its own safety machine allows.
        people: Everybody in the greenhouse.
    """

    robot_id: str
    at: float
    lasts_s: float
    speed: float
    wanted: float
    factor: float
    people: tuple[NearPerson, ...]

    @property
    def is_slowed(self) -> bool:
        """Whether it is limited to half speed or less."""
        return self.factor <= HALF_SPEED


def _seconds() -> defaultdict[Sight, float]:
    return defaultdict(float)


@dataclass(slots=True)
class Protection:
    """Sums over a run, or over several.

    Attributes:
        driven_s: Time for which robots moved.
        near_s: Person-seconds near a moving robot, by ``Sight``; ``slowed_s`` of them
            while it was limited.
        needless_s: Time for which a moving robot was limited with nobody near.
        delays_s: Delay of each encounter; None: the robot was never limited.
        foretold_s: Of each entry, time since iVeg published it; None: it had not.
    """

    driven_s: float = 0.0
    needless_s: float = 0.0
    near_s: defaultdict[Sight, float] = field(default_factory=_seconds)
    slowed_s: defaultdict[Sight, float] = field(default_factory=_seconds)
    delays_s: list[float | None] = field(default_factory=list)
    foretold_s: list[float | None] = field(default_factory=list)

    def row(self) -> Json:
        """The numbers by name; None where there was nothing to count."""
        near, slowed = sum(self.near_s.values()), sum(self.slowed_s.values())
        by_sight = {
            sight: share(self.slowed_s[sight], self.near_s[sight]) for sight in SIGHTS
        }
        in_time = sum((s or 0.0) >= AHEAD_S - ROUNDING_S for s in self.foretold_s)
        return {
            "near_s": {sight: round(self.near_s[sight], 2) for sight in SIGHTS},
            "slowed": {**by_sight, "all": share(slowed, near)},
            "encounters": len(self.delays_s),
            "never_slowed": self.delays_s.count(None),
            "delay_p95_s": p95([s for s in self.delays_s if s is not None]),
            "needless": share(self.needless_s, self.driven_s),
            "entries": len(self.foretold_s),
            "foretold": share(in_time, len(self.foretold_s)),
        }


def total_of(runs: Iterable[Protection]) -> Protection:
    """The sum of several runs."""
    total = Protection()
    for run in runs:
        total.driven_s += run.driven_s
        total.needless_s += run.needless_s
        for sight in SIGHTS:
            total.near_s[sight] += run.near_s[sight]
            total.slowed_s[sight] += run.slowed_s[sight]
        total.delays_s += run.delays_s
        total.foretold_s += run.foretold_s
    return total


def share(part: float, whole: float) -> float | None:
    """A share to four digits; None of nothing."""
    return None if whole == 0.0 else round(part / whole, 4)


def p95(values: Sequence[float]) -> float | None:
    """95th percentile to three digits; None of nothing."""
    if len(values) < 2:
        return values[0] if values else None
    return round(quantiles(values, n=20, method="inclusive")[-1], 3)


_STILL_S: Final = 0.25
"""Time for which a picture counts, or the time between two (s)."""
_SAME_M: Final = 1.0
"""Greatest error of the place at which iVeg has a person (m)."""


def moments_of(
    truth: Iterable[Row], encounters: Sequence[Row] = ()
) -> Iterator[NearMoment]:
    """Every robot at each of its pictures, in the order of time.

    Args:
        truth: Rows of the truth.
        encounters: With people, as iVeg published them: ``robot``, ``at``, ``people``
            (each a place ``x``, ``y`` at which iVeg has a person), at the same times.
    """
    people_at = {(row["robot"], row["at"]): row["people"] for row in encounters}
    newest: dict[str, Row] = {}
    for at, same in groupby(sorted(truth, key=itemgetter("at")), itemgetter("at")):
        rows, before = list(same), dict(newest)
        newest.update({row["robot"]: row for row in rows})
        young = (row for row in newest.values() if at - row["at"] <= _STILL_S)
        in_view = {target["key"] for row in young for target in row["visible"]}
        for row in rows:
            places = people_at.get((row["robot"], at), ())
            last_at = before.get(row["robot"], row)["at"]
            yield NearMoment(
                row["robot"],
                at,
                min(at - last_at, _STILL_S),
                abs(row["speed"]),
                row["wanted"],
                row["factor"],
                tuple(_people(row, in_view, places)),
            )


def _people(row: Row, in_view: set[str], places: Sequence[Row]) -> Iterator[NearPerson]:
    expected = {person_at(row["people"], place["x"], place["y"]) for place in places}
    here = row["pose"]["x"], row["pose"]["y"]
    for person in row["people"]:
        key, there = person["key"], (person["x"], person["y"])
        sight: Sight = "in_view" if key in in_view else "unseen"
        yield NearPerson(key, dist(here, there), sight, key in expected)


def person_at(people: Iterable[Row], x: float, y: float) -> str | None:
    """Person at a place (m), by the truth's keys; None: nobody."""
    distances = {
        person["key"]: dist((person["x"], person["y"]), (x, y)) for person in people
    }
    nearest = min(distances, key=lambda key: distances[key], default=None)
    return nearest if nearest is not None and distances[nearest] <= _SAME_M else None


_PAUSE_S = 1.0


_IN_VIEW_S = 2.0
_GLIMPSE_S = 0.5
"""Shorter views without a slow-down are no encounter: six pictures of a detector."""


def protection_of(moments: Iterable[NearMoment]) -> Protection:
    """The sums of one run, whose moments come in the order of time."""
    sums, pairs = Protection(), defaultdict[tuple[str, str], _Pair](_Pair)
    for moment in moments:
        if moment.speed >= MOVES_M_S:
            _add_driving(sums, moment)
        for person in moment.people:
            pair = pairs[moment.robot_id, person.name]
            _note_entry(sums, pair, moment, person)
            if moment.speed >= MOVES_M_S and person.distance_m <= NEAR_M:
                _add_near(sums, pair, moment, person)
    encounters = chain.from_iterable(pair.encounters for pair in pairs.values())
    for encounter in sorted(encounters, key=attrgetter("began")):
        if encounter.delay_s is not None:
            sums.delays_s.append(round(encounter.delay_s, 3))
        elif encounter.last - encounter.began >= _GLIMPSE_S - ROUNDING_S:
            sums.delays_s.append(None)
    return sums


def _add_driving(sums: Protection, moment: NearMoment) -> None:
    sums.driven_s += moment.lasts_s
    nearest = min((person.distance_m for person in moment.people), default=inf)
    if moment.is_slowed and nearest > AWAY_M:
        sums.needless_s += moment.lasts_s


@dataclass(slots=True)
class _Encounter:
    """One robot near one person in view (s); ``delay_s`` None: never limited."""

    began: float
    last: float
    delay_s: float | None = None


@dataclass(slots=True)
class _Pair:
    """State of one robot and one person.

    Attributes:
        in_view_since: Time since which the person is in view without a break (s); None:
            not in view.
        published_since: Time since which iVeg publishes an encounter of the two without
            a break of a second (s); ``published_at`` when it did last.
        is_outside: Whether the person was outside the zone.
    """

    in_view_since: float | None = None
    published_since: float = -inf
    published_at: float = -inf
    is_outside: bool = False
    encounters: list[_Encounter] = field(default_factory=list)


def _add_near(
    sums: Protection, pair: _Pair, moment: NearMoment, person: NearPerson
) -> None:
    """Count a person near a moving robot, and their encounter if in view."""
    sums.near_s[person.sight] += moment.lasts_s
    sums.slowed_s[person.sight] += moment.lasts_s * moment.is_slowed
    if person.sight != "in_view":
        return
    if not pair.encounters or moment.at - pair.encounters[-1].last > _PAUSE_S:
        pair.encounters.append(_Encounter(moment.at, moment.at))
    encounter = pair.encounters[-1]
    encounter.last = moment.at
    if moment.is_slowed and encounter.delay_s is None:
        encounter.delay_s = moment.at - encounter.began


def _note_entry(
    sums: Protection, pair: _Pair, moment: NearMoment, person: NearPerson
) -> None:
    """Count a zone entry, if this is one."""
    at = moment.at
    if person.sight != "in_view":
        pair.in_view_since = None
    elif pair.in_view_since is None:
        pair.in_view_since = at
    in_view_s = 0.0 if pair.in_view_since is None else at - pair.in_view_since
    is_known = in_view_s >= _IN_VIEW_S - ROUNDING_S
    enters = pair.is_outside and person.distance_m <= NEAR_M
    if enters and is_known and moment.wanted > MOVES_M_S:
        is_published = at - pair.published_at <= _PAUSE_S
        lead_s = round(at - pair.published_since, 3) if is_published else None
        sums.foretold_s.append(lead_s)
    pair.is_outside = person.distance_m > NEAR_M
    if person.has_encounter:
        if at - pair.published_at > _PAUSE_S:
            pair.published_since = at
        pair.published_at = at
