"""What stands unchanged for ten minutes beside what the plan draws."""

import math
from dataclasses import replace

import numpy as np
import pytest

from iveg.domain.doubt import Doubts
from iveg.domain.feedback import SpeedLimit
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.known_here import FROM_PLAN_M, MOST_CELLS, STANDS_S, KnownHere
from iveg.domain.observations import Instant
from iveg.domain.witness import KnownBody, Plan
from iveg.lab.emulator.greenhouse import Disc, Scenery
from iveg.lab.emulator.lidar import LaserModel, sweep
from tests.builders import at, scan
from tests.unit.domain.rule.test_obstacles import AISLE, Aisle

HERE = Pose2D(0.0, 0.0, 0.0)
ROW_Y = 1.0
TUFT = Disc(1.5, ROW_Y - 0.38, 0.1)
"""Its near side is 0.48 m from the row that the plan draws."""
_MODEL = LaserModel()


class Spot:
    """Looks from one place, ten seconds apart.

    Attributes:
        known: What is learnt.
        now: (s).
    """

    def __init__(self) -> None:
        self.known = KnownHere(Plan.of(AISLE))
        self.now = 0.0

    def look(
        self,
        *things: Disc,
        lasts_s: float = 10.0,
        after_s: float = 10.0,
        bodies: tuple[KnownBody, ...] = (),
    ) -> "Spot":
        for _ in range(round(lasts_s / after_s)):
            self.now += after_s
            points = self.points(*things)
            self.known.learn(points, HERE, bodies, at(self.now))
        return self

    def points(
        self, *things: Disc
    ) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        rng = np.random.default_rng(round(self.now))
        ranges = sweep(HERE, _MODEL, Scenery.of(AISLE), things, [], rng)
        said = scan("AGI", ranges, angle_min=-math.pi)
        said = replace(said, angle_increment=_MODEL.angle_increment)
        return said.points(HERE).astype(np.float64)

    def explained(self, *things: Disc) -> int:
        """How many returns of what is there it explains."""
        return int(self.known.explains(*self.points(*things).T).sum())


def learnt() -> Spot:
    spot = Spot().look(TUFT, lasts_s=STANDS_S + 10.0)
    assert spot.explained(TUFT) >= 2
    return spot


def test_what_stood_in_every_look_of_ten_minutes_is_known_here() -> None:
    spot = Spot().look(TUFT, lasts_s=STANDS_S)
    assert spot.explained(TUFT) == 0, "ten seconds too early"
    spot.look(TUFT)
    assert spot.explained(TUFT) >= 2
    assert spot.explained() == 0


def test_nothing_is_learnt_farther_than_half_a_metre_from_the_plan() -> None:
    crate = Disc(1.5, 0.3, 0.2)
    spot = Spot().look(crate, lasts_s=STANDS_S + 10.0)
    assert spot.known.places == []
    standing = Disc(1.5, ROW_Y - 0.4, 0.25)
    spot.look(standing, lasts_s=STANDS_S + 10.0)
    points = spot.points(standing)
    (y,) = points[spot.known.explains(*points.T)][:, 1:].T
    assert y.min(initial=math.inf) >= ROW_Y - FROM_PLAN_M
    body = points[np.hypot(points[:, 0] - 1.5, points[:, 1] - standing.y) <= 0.3]
    assert np.count_nonzero(~spot.known.explains(*body.T)) > 10, "the greater part"


def test_what_was_gone_for_one_look_is_learnt_anew() -> None:
    spot = Spot().look(TUFT, lasts_s=STANDS_S).look().look(TUFT)
    assert spot.explained(TUFT) == 0
    assert learnt().look().explained(TUFT) == 0, "what was known, too"


def test_what_hides_a_place_says_nothing_of_it() -> None:
    spot = learnt()
    spot.look(Disc(0.8, TUFT.y * 0.8 / 1.5, 0.2))
    assert spot.explained(TUFT) >= 2


@pytest.mark.parametrize("place", [(1.5, 0.4), (1.3, 0.7)])
def test_who_moves_there_ends_it(place: tuple[float, float]) -> None:
    spot = learnt()
    spot.known.moved([(1.5, -0.6)])
    assert spot.explained(TUFT) >= 2, "at the other row"
    spot.known.moved([place])
    assert spot.explained(TUFT) == 0
    spot.look(TUFT, lasts_s=STANDS_S)
    assert spot.explained(TUFT) == 0, "and ten minutes begin anew"


def test_a_place_that_nobody_looked_at_for_long_is_learnt_anew() -> None:
    spot = Spot().look(TUFT, lasts_s=STANDS_S - 10.0)
    spot.look(TUFT, lasts_s=160.0, after_s=160.0)
    assert spot.explained(TUFT) == 0


def test_what_may_be_a_peer_or_a_person_is_not_learnt() -> None:
    bodies = (KnownBody(TUFT.x, TUFT.y - 0.2, 0.6),)
    assert Spot().look(TUFT, lasts_s=700.0, bodies=bodies).explained(TUFT) == 0


def test_it_ends_with_the_day() -> None:
    spot = learnt()
    late = Instant(wall=at(spot.now).wall + 86_400.0, mono=at(spot.now).mono)
    spot.known.learn(spot.points(TUFT), HERE, (), late)
    assert spot.explained(TUFT) == 0


def test_no_more_than_a_bounded_number_is_kept() -> None:
    long = replace(AISLE, rows=(Rectangle(-39.0, 1.0, 39.0, 1.4),) * 2)
    known, x = KnownHere(Plan.of(long)), np.arange(-39.0, 39.0, 0.05)
    for step in range(-39, 39):
        for y in (0.55, 1.85):
            points = np.column_stack((x, np.full_like(x, y)))
            known.learn(points, Pose2D(step, y, 0.0), (), at(0.0))
    assert len(known._cells) <= MOST_CELLS


# --- in the rule ----------------------------------------------------------------------


class Passes(Aisle):
    """AGI drives by the tuft every two minutes."""

    tuft = (0.0, ROW_Y - 0.22)

    def pass_by(self, *others: tuple[float, float]) -> list[SpeedLimit]:
        self.now += 117.0
        return [
            self.step(self.tuft, *others, x=-1.5 + 0.1 * n, linear=1.0)
            for n in range(30)
        ]

    def for_minutes(self, minutes: float) -> "Passes":
        while self.now < 60.0 * minutes:
            self.pass_by()
        return self


def reasons(limits: list[SpeedLimit]) -> set[str]:
    return {one.reason for one in limits}


def test_a_plan_that_is_off_slows_the_farm_for_ten_minutes_and_no_longer() -> None:
    aisle = Passes(greenhouse=AISLE)
    assert reasons(aisle.pass_by()) == {"clear", "obstacle"}
    assert reasons(aisle.for_minutes(13.0).pass_by()) == {"clear"}


def test_who_walks_up_to_a_known_place_or_past_it_is_seen_as_before() -> None:
    aisle = Passes(greenhouse=AISLE).for_minutes(13.0)
    assert "obstacle" in reasons(aisle.pass_by((0.0, 0.4))), "before it"
    aisle = Passes(greenhouse=AISLE).for_minutes(13.0)
    aisle.now += 5.0
    limits = [
        aisle.step(aisle.tuft, (-1.5 + 0.1 * n, 0.5), x=0.0, linear=0.0)
        for n in range(30)
    ]
    assert limits[-1].speed_factor == 0.5
    assert any(one.newest.laser for one in aisle.everyone)
    assert aisle.obstacles.known_here.places == [], "whoever walked there ended it"


def test_a_robot_in_doubt_teaches_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Doubts, "is_open", lambda *_: True)
    aisle = Passes(greenhouse=AISLE).for_minutes(13.0)
    assert aisle.obstacles.known_here.places == []
