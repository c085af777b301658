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
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from statistics import quantiles
from typing import Final, Literal

from iveg.domain.records import Json

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

    @classmethod
    def read(cls, stored: Json) -> "Protection":
        """What a result file has of it."""
        entries = [Entry(**one) for one in stored["entries"]]
        return cls(**{**stored, "entries": entries})

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
