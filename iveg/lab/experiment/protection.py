"""Protection: were people near a moving robot protected, scored against the truth.

It looks from outside: where robots and people really are, what a camera really has in
view, how fast a robot may drive by its own safety machine.  What iVeg believed, decided
or told does not count, except for when it told of an encounter.

*Near* is within two metres of a robot that moves; an *encounter* is one robot near one
person in view of some camera, without a pause of a second; its *delay* is the time
from there until the robot is limited to half speed.  An *entry* is a ring that a robot
reaches, or is reached by, around somebody who has been in view for two seconds, who has
stepped into view since, which leaves nobody the time to slow before, or who is in no
camera's view.

A person is in view where the newest picture of some robot has them, if it is not older
than a quarter of a second: robots take theirs at different times.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from math import dist
from operator import itemgetter
from statistics import quantiles
from typing import Final, Literal

from iveg.domain.feedback import HALF_SPEED
from iveg.domain.records import Json
from iveg.lab.experiment.stage import Row

Sight = Literal["in_view", "behind_plants", "unseen"]
"""In view of some camera; hidden from the robot that is near; neither."""
SIGHTS: Final[tuple[Sight, ...]] = ("in_view", "behind_plants", "unseen")
Known = Literal["in_view", "stepped_out", "unseen"]
"""In view for two seconds, for less, not at all."""
KNOWN: Final[tuple[Known, ...]] = ("in_view", "stepped_out", "unseen")
NEAR_M = 2.0
"""The ring of the rule (m)."""
AWAY_M = (2.3, 4.0)
"""Slowed with nobody so near is needless: at the ring, and far away (m)."""
MOVES_M_S = 0.05
SLOW_SHARE = 0.55
"""Of the speed that a robot wants: half, and what noise adds."""
AHEAD_S = 1.5
"""So long before its entry an encounter should be told (s)."""
ROUNDING_S = 1e-6


@dataclass(frozen=True, slots=True)
class NearPerson:
    """A person as one robot has them about it.

    Attributes:
        distance_m: From the robot's ``base_link`` to the person.
        foretold: iVeg tells an encounter of this robot with the person.
    """

    name: str
    distance_m: float
    sight: Sight
    foretold: bool = False


@dataclass(frozen=True, slots=True)
class NearMoment:
    """One robot at one moment.

    Attributes:
        at: (s); ``lasts_s`` for how long it counts.
        speed: True speed (m/s).
        wanted: Speed that it would drive if nothing limited it (m/s).
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


@dataclass(frozen=True, slots=True)
class Entry:
    """A robot and a person came within two metres.

    Attributes:
        speed_share: Of its wanted speed that the robot drove.
        foretold_s: For how long iVeg had told of it (s); None: it had not.
        known: How well cameras had the person in view.
    """

    speed_share: float
    foretold_s: float | None
    known: Known

    @property
    def is_foretold(self) -> bool:
        """Whether iVeg told of it long enough before."""
        return (self.foretold_s or 0.0) >= AHEAD_S - ROUNDING_S


def _nothing() -> dict[str, float]:
    return dict.fromkeys(SIGHTS, 0.0)


@dataclass(slots=True)
class Protection:
    """Sums over a run, or over several.

    Attributes:
        driven_s: Robots moved; ``driven_m`` so far.
        near_s: Person-seconds near a moving robot, by ``Sight``; ``slowed_s`` of them
            while it was limited.
        needless_s: A moving robot was limited with nobody within so many metres.
        delays_s: Of each encounter; None: the robot was never limited.
        entries: Each as ``Entry`` has it.
    """

    driven_s: float = 0.0
    driven_m: float = 0.0
    near_s: dict[str, float] = field(default_factory=_nothing)
    slowed_s: dict[str, float] = field(default_factory=_nothing)
    needless_s: dict[str, float] = field(
        default_factory=lambda: {f"{away_m:g}": 0.0 for away_m in AWAY_M}
    )
    delays_s: list[float | None] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)

    def row(self) -> Json:
        """The numbers by name; None where there was nothing to count."""
        near, slowed = sum(self.near_s.values()), sum(self.slowed_s.values())
        delays = [one for one in self.delays_s if one is not None]
        return {
            "near_s": {one: round(self.near_s[one], 2) for one in SIGHTS},
            "slowed": {
                **{one: share(self.slowed_s[one], self.near_s[one]) for one in SIGHTS},
                "all": share(slowed, near),
            },
            "encounters": len(self.delays_s),
            "never_slowed": self.delays_s.count(None),
            "delay_p50_s": _quantile(delays, 50),
            "delay_p95_s": _quantile(delays, 95),
            "needless": {
                away_m: share(spent_s, self.driven_s)
                for away_m, spent_s in self.needless_s.items()
            },
            "driven_m": round(self.driven_m, 1),
            "entries": {
                known: _entered([one for one in self.entries if one.known == known])
                for known in KNOWN
            },
        }


def _entered(entries: list[Entry]) -> Json:
    foretold = sum(one.is_foretold for one in entries)
    slow = sum(one.speed_share <= SLOW_SHARE for one in entries)
    return {
        "count": len(entries),
        "foretold": share(foretold, len(entries)),
        "slow": share(slow, len(entries)),
    }


def whole(runs: Iterable[Protection]) -> Protection:
    """The sum of several runs."""
    total = Protection()
    for one in runs:
        total.driven_s += one.driven_s
        total.driven_m += one.driven_m
        for sums, more in (
            (total.near_s, one.near_s),
            (total.slowed_s, one.slowed_s),
            (total.needless_s, one.needless_s),
        ):
            for key, spent_s in more.items():
                sums[key] += spent_s
        total.delays_s += one.delays_s
        total.entries += one.entries
    return total


def share(part: float, of: float) -> float | None:
    """A share to four digits; None of nothing."""
    return None if of == 0.0 else round(part / of, 4)


def _quantile(values: list[float], percent: int) -> float | None:
    if len(values) < 2:
        return values[0] if values else None
    return round(quantiles(values, n=100, method="inclusive")[percent - 1], 3)


_STILL_S: Final = 0.25
"""How long a picture, or a gap between two, counts (s)."""
_SAME_M: Final = 1.0
"""Who is farther from where iVeg has somebody is somebody else (m)."""


def moments_of(
    truth: Iterable[Row], encounters: Sequence[Row] = ()
) -> Iterator[NearMoment]:
    """Every robot at each of its pictures, in the order of time.

    Args:
        truth: Rows of the truth.
        encounters: With people, as iVeg told them: ``robot``, ``at``, ``people``
            (each the place ``x``, ``y`` where iVeg has somebody), at the same times.
    """
    people_at = {(one["robot"], one["at"]): one["people"] for one in encounters}
    newest: dict[str, Row] = {}
    for at, same in groupby(sorted(truth, key=itemgetter("at")), itemgetter("at")):
        rows, before = list(same), dict(newest)
        newest.update({row["robot"]: row for row in rows})
        young = (row for row in newest.values() if at - row["at"] <= _STILL_S)
        in_view = {one["key"] for row in young for one in row["visible"]}
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
    foretold = {person_at(row["people"], one["x"], one["y"]) for one in places}
    here = row["pose"]["x"], row["pose"]["y"]
    for one in row["people"]:
        key = one["key"]
        sight: Sight = "behind_plants" if one["hidden"] else "unseen"
        if key in in_view:
            sight = "in_view"
        yield NearPerson(key, dist(here, (one["x"], one["y"])), sight, key in foretold)


def person_at(people: Iterable[Row], x: float, y: float) -> str | None:
    """Who really is at a place (m), by the truth's keys; None: nobody."""
    away = {one["key"]: dist((one["x"], one["y"]), (x, y)) for one in people}
    nearest = min(away, key=lambda key: away[key], default=None)
    return nearest if nearest is not None and away[nearest] <= _SAME_M else None


_PAUSE_S = 1.0


_IN_VIEW_S = 2.0
_GLIMPSE_S = 0.5
"""Shorter views without a slow-down are no encounter: six pictures of a detector."""


def protection_of(moments: Iterable[NearMoment]) -> Protection:
    """The sums of one run, whose moments come in the order of time."""
    score = _Score()
    for moment in moments:
        score.add(moment)
    delays = [one.delay_s for one in score.encounters if one.counts]
    score.sums.delays_s = [None if s is None else round(s, 3) for s in delays]
    return score.sums


@dataclass(slots=True)
class _Encounter:
    """One robot near one person in view, all in s."""

    began: float
    last: float
    slowed_at: float | None = None

    @property
    def delay_s(self) -> float | None:
        """From its begin until the robot was limited (s); None: never."""
        return None if self.slowed_at is None else self.slowed_at - self.began

    @property
    def counts(self) -> bool:
        """Whether it was more than a glimpse, or slowed the robot."""
        lasted = self.last - self.began >= _GLIMPSE_S - ROUNDING_S
        return lasted or self.slowed_at is not None


@dataclass(slots=True)
class _Pair:
    """One person as one robot had them before.

    Attributes:
        seen_since: Since when in view without a break (s); None: not in view.
        told_since: Since when iVeg tells of them, without a break of a second (s);
            ``told_at`` when it did last.
        outside: Whether the ring lay between them.
    """

    seen_since: float | None = None
    told_since: float | None = None
    told_at: float = float("-inf")
    outside: bool = False
    encounter: _Encounter | None = None


@dataclass(slots=True)
class _Score:
    """Counts moment by moment."""

    sums: Protection = field(default_factory=Protection)
    encounters: list[_Encounter] = field(default_factory=list)
    _pairs: dict[tuple[str, str], _Pair] = field(default_factory=dict)

    def add(self, moment: NearMoment) -> None:
        """Count one moment of one robot."""
        for person in moment.people:
            self.note_entry(moment, person)
        if moment.speed < MOVES_M_S:
            return
        slowed = moment.factor <= HALF_SPEED
        self.sums.driven_s += moment.lasts_s
        self.sums.driven_m += moment.speed * moment.lasts_s
        nearest = min((one.distance_m for one in moment.people), default=float("inf"))
        for away_m in AWAY_M:
            if slowed and nearest > away_m:
                self.sums.needless_s[f"{away_m:g}"] += moment.lasts_s
        for person in moment.people:
            if person.distance_m <= NEAR_M:
                self._add_near(moment, person, slowed=slowed)

    def note_entry(self, moment: NearMoment, person: NearPerson) -> None:
        """Count an entry, if this is one."""
        pair = self._pairs.setdefault((moment.robot_id, person.name), _Pair())
        if person.sight != "in_view":
            pair.seen_since = None
        elif pair.seen_since is None:
            pair.seen_since = moment.at
        outside = person.distance_m > NEAR_M
        if pair.outside and not outside and moment.wanted > MOVES_M_S:
            share_ = round(moment.speed / moment.wanted, 4)
            known = _known(pair, moment.at)
            self.sums.entries.append(Entry(share_, _told_s(pair, moment.at), known))
        pair.outside = outside
        if person.foretold:
            if moment.at - pair.told_at > _PAUSE_S:
                pair.told_since = moment.at
            pair.told_at = moment.at

    def _add_near(
        self, moment: NearMoment, person: NearPerson, *, slowed: bool
    ) -> None:
        self.sums.near_s[person.sight] += moment.lasts_s
        self.sums.slowed_s[person.sight] += moment.lasts_s * slowed
        if person.sight != "in_view":
            return
        encounter = self._encounter(moment.robot_id, person.name, moment.at)
        if slowed and encounter.slowed_at is None:
            encounter.slowed_at = moment.at

    def _encounter(self, robot_id: str, person: str, at: float) -> _Encounter:
        pair = self._pairs[robot_id, person]
        if pair.encounter is None or at - pair.encounter.last > _PAUSE_S:
            pair.encounter = _Encounter(at, at)
            self.encounters.append(pair.encounter)
        pair.encounter.last = at
        return pair.encounter


def _known(pair: _Pair, at: float) -> Known:
    if pair.seen_since is None:
        return "unseen"
    is_long = at - pair.seen_since >= _IN_VIEW_S - ROUNDING_S
    return "in_view" if is_long else "stepped_out"


def _told_s(pair: _Pair, at: float) -> float | None:
    """For how long iVeg has told of an encounter that is about to begin (s)."""
    if pair.told_since is None or at - pair.told_at > _PAUSE_S:
        return None
    return round(at - pair.told_since, 3)
