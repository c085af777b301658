"""Protection: were people near a moving robot protected, scored against the truth.

It looks from outside: where robots and people really are, what a camera really has in
view, how fast a robot may drive by its own safety machine.  What iVeg believed, decided
or told does not count.

*Near* is within two metres of a robot that moves; an *encounter* is one robot near one
person in view of some camera, without a pause of a second; its *delay* is the time
from there until the robot is limited to half speed.  An *entry* is a ring that a robot
reaches, or is reached by, around somebody who has been in view for two seconds: whoever
steps out from behind plants gives nobody the time to slow before.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from statistics import quantiles

from iveg.domain.feedback import HALF_SPEED

NEAR_M = 2.0
"""The ring of the rule (m)."""
AWAY_M = (2.3, 4.0)
"""Slowed with nobody so near is needless: at the ring, and far away (m)."""
MOVES_M_S = 0.05
_PAUSE_S = 1.0
_IN_VIEW_S = 2.0
SLOW_SHARE = 0.55
"""Of the speed that a robot wants: half, and what noise adds."""


@dataclass(frozen=True, slots=True)
class NearPerson:
    """A person as one robot has them about it.

    Attributes:
        distance_m: From the robot's ``base_link`` to the person.
        in_view: Some robot's camera has a part of the person in view.
    """

    name: str
    distance_m: float
    in_view: bool


@dataclass(frozen=True, slots=True)
class Moment:
    """One robot at one moment.

    Attributes:
        at: (s).
        speed: True speed (m/s).
        wanted: Speed that it would drive if nothing limited it (m/s).
        factor: Greatest speed factor that its own safety machine allows.
        people: Everybody in the greenhouse.
    """

    robot_id: str
    at: float
    speed: float
    wanted: float
    factor: float
    people: tuple[NearPerson, ...]


@dataclass(slots=True)
class Encounter:
    """One robot near one person in view.

    Attributes:
        began: (s); ``last`` the newest moment of it.
        slowed_at: When the robot was limited first (s); None: not yet.
    """

    began: float
    last: float
    slowed_at: float | None = None

    @property
    def delay_s(self) -> float | None:
        """From its begin until the robot was limited (s); None: never."""
        return None if self.slowed_at is None else self.slowed_at - self.began


@dataclass(slots=True)
class _Seen:
    """One person as one robot had them before.

    Attributes:
        since: Since when in view without a break (s); None: not in view.
        outside: Whether the ring lay between them.
    """

    since: float | None = None
    outside: bool = False


@dataclass(slots=True)
class ProtectionScore:
    """Sums over the moments of a run, each of ``step_s`` seconds.

    Attributes:
        driven_s: Robots moved; ``driven_m`` so far.
        near_s: Person-seconds near a moving robot; ``near_slowed_s`` of them while it
            was limited.
        view_s: Of these the person was in some camera's view; ``view_slowed_s`` too.
        needless_s: A moving robot was limited with nobody within so many metres.
        encounters: All that have begun, in their order.
        entries: Of each entry the share of its wanted speed that the robot drove.
    """

    step_s: float
    driven_s: float = 0.0
    driven_m: float = 0.0
    near_s: float = 0.0
    near_slowed_s: float = 0.0
    view_s: float = 0.0
    view_slowed_s: float = 0.0
    needless_s: dict[float, float] = field(
        default_factory=lambda: dict.fromkeys(AWAY_M, 0.0)
    )
    encounters: list[Encounter] = field(default_factory=list)
    entries: list[float] = field(default_factory=list)
    _seen: dict[tuple[str, str], _Seen] = field(default_factory=dict)
    _open: dict[tuple[str, str], Encounter] = field(default_factory=dict)

    def add(self, moment: Moment) -> None:
        """Count one moment of one robot."""
        for person in moment.people:
            self._note_entry(moment, person)
        if moment.speed < MOVES_M_S:
            return
        slowed = moment.factor <= HALF_SPEED
        self.driven_s += self.step_s
        self.driven_m += moment.speed * self.step_s
        nearest = min((one.distance_m for one in moment.people), default=float("inf"))
        for away_m in AWAY_M:
            if slowed and nearest > away_m:
                self.needless_s[away_m] += self.step_s
        for person in moment.people:
            if person.distance_m <= NEAR_M:
                self._add_near(moment, person, slowed=slowed)

    def _note_entry(self, moment: Moment, person: NearPerson) -> None:
        seen = self._seen.setdefault((moment.robot_id, person.name), _Seen())
        outside = person.distance_m > NEAR_M
        known = seen.since is not None and moment.at - seen.since >= _IN_VIEW_S - 1e-9
        if seen.outside and not outside and known and moment.wanted > MOVES_M_S:
            self.entries.append(moment.speed / moment.wanted)
        seen.outside = outside
        if not person.in_view:
            seen.since = None
        elif seen.since is None:
            seen.since = moment.at

    def _add_near(self, moment: Moment, person: NearPerson, *, slowed: bool) -> None:
        self.near_s += self.step_s
        self.near_slowed_s += self.step_s * slowed
        if not person.in_view:
            return
        self.view_s += self.step_s
        self.view_slowed_s += self.step_s * slowed
        encounter = self._encounter(moment.robot_id, person.name, moment.at)
        if slowed and encounter.slowed_at is None:
            encounter.slowed_at = moment.at

    def _encounter(self, robot_id: str, person: str, at: float) -> Encounter:
        found = self._open.get((robot_id, person))
        if found is None or at - found.last > _PAUSE_S:
            found = self._open[robot_id, person] = Encounter(at, at)
            self.encounters.append(found)
        found.last = at
        return found

    # --- the numbers --------------------------------------------------------------

    @property
    def never_slowed(self) -> int:
        """Encounters in which the robot was never limited."""
        return sum(one.slowed_at is None for one in self.encounters)

    def row(self) -> Mapping[str, float | None]:
        """The numbers by name; None where there was nothing to count."""
        delays = [one.delay_s for one in self.encounters if one.delay_s is not None]
        return {
            "slowed, in view": _share(self.view_slowed_s, self.view_s),
            "slowed, all": _share(self.near_slowed_s, self.near_s),
            "encounters": len(self.encounters),
            "never slowed": self.never_slowed,
            "delay P50 s": _quantile(delays, 50),
            "delay P95 s": _quantile(delays, 95),
            **{
                f"needless > {away_m:g} m": _share(spent_s, self.driven_s)
                for away_m, spent_s in self.needless_s.items()
            },
            "driven m": round(self.driven_m, 1),
            "entries": len(self.entries),
            "slow at the ring": _share(
                sum(one <= SLOW_SHARE for one in self.entries), len(self.entries)
            ),
        }


def whole(scores: Iterable[ProtectionScore]) -> ProtectionScore:
    """The sum of several runs."""
    scores = list(scores)
    total = ProtectionScore(scores[0].step_s)
    for one in scores:
        for name in _SUMS:
            setattr(total, name, getattr(total, name) + getattr(one, name))
        for away_m, spent_s in one.needless_s.items():
            total.needless_s[away_m] += spent_s
        total.encounters += one.encounters
        total.entries += one.entries
    return total


_SUMS = (
    *("driven_s", "driven_m", "near_s"),
    *("near_slowed_s", "view_s", "view_slowed_s"),
)


def _share(part: float, of: float) -> float | None:
    return None if of == 0.0 else round(part / of, 4)


def _quantile(values: list[float], percent: int) -> float | None:
    if len(values) < 2:
        return values[0] if values else None
    return round(quantiles(values, n=100, method="inclusive")[percent - 1], 3)
