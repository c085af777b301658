"""Protection: were people near a moving robot protected, scored against the truth.

It looks from outside: where robots and people really are, what a camera really has in
view, how fast a robot may drive by its own safety machine.  What iVeg believed, decided
or told does not count.

*Near* is within two metres of a robot that moves; an *encounter* is one robot near one
person in view of some camera, without a pause of a second; its *delay* is the time
from there until the robot is limited to half speed.
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
        factor: Greatest speed factor that its own safety machine allows.
        people: Everybody in the greenhouse.
    """

    robot_id: str
    at: float
    speed: float
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
class ProtectionScore:
    """Sums over the moments of a run, each of ``step_s`` seconds.

    Attributes:
        driven_s: Robots moved; ``driven_m`` so far.
        near_s: Person-seconds near a moving robot; ``near_slowed_s`` of them while it
            was limited.
        view_s: Of these the person was in some camera's view; ``view_slowed_s`` too.
        needless_s: A moving robot was limited with nobody within so many metres.
        encounters: All that have begun, in their order.
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
    _open: dict[tuple[str, str], Encounter] = field(default_factory=dict)

    def add(self, moment: Moment) -> None:
        """Count one moment of one robot."""
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
