"""Protection of a run, counted moment by moment."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from iveg.domain.feedback import HALF_SPEED
from iveg.lab.experiment.protection import (
    AWAY_M,
    MOVES_M_S,
    NEAR_M,
    ROUNDING_S,
    Entry,
    Known,
    NearMoment,
    NearPerson,
    Protection,
)

_PAUSE_S = 1.0


_IN_VIEW_S = 2.0


def protection_of(moments: Iterable[NearMoment]) -> Protection:
    """The sums of one run, whose moments come in the order of time."""
    score = _Score()
    for moment in moments:
        score.add(moment)
    delays = [one.delay_s for one in score.encounters]
    score.sums.delays_s = [None if s is None else round(s, 3) for s in delays]
    return score.sums


def entries_of(
    moments: Iterable[NearMoment],
) -> Iterator[tuple[NearMoment, NearPerson, Entry]]:
    """Each entry of one run, as ``protection_of`` counts it, with whose it is."""
    score = _Score()
    for moment in moments:
        for person in moment.people:
            known = len(score.sums.entries)
            score.note_entry(moment, person)
            for entry in score.sums.entries[known:]:
                yield moment, person, entry


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
