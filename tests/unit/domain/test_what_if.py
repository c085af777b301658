"""The rule as arrays over what was kept, beside the rule that ran."""

import math
import random
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.records import DecisionRecord, DetectionRecord, OdometryRecord
from iveg.domain.what_if.inputs import Inputs, PoseRow, SeenRow, poses_of, sightings_of
from iveg.domain.what_if.judging import Range
from iveg.domain.what_if.outcome import Outcome, outcomes_of
from iveg.domain.what_if.parameters import Parameters
from iveg.domain.what_if.steps import STEP_S
from iveg.domain.what_if.truth import nearest_of
from tests.builders import START, detection, odometry
from tests.unit.pipeline.desk import Desk


def outcome_of(judged: Range, tried: Parameters, leads_s: float = 0.0) -> Outcome:
    (found,) = outcomes_of(judged, [tried], leads_s)
    return found


BRAKING = {"AGI": 1.0, "AGII": 1.0}
BEGINS_S, ENDS_S = 0.3, 0.45
"""A look ahead, and a tick; who is let go was looked at once more."""


def inputs_of(desk: Desk) -> Inputs:
    """What the history has of a run."""
    poses: dict[str, list[PoseRow]] = defaultdict(list)
    for said in desk.records(OdometryRecord):
        row = said.at, said.x, said.y, said.yaw, said.linear, said.angular
        poses[said.robot_id].append(row)
    seen: list[SeenRow] = [
        (
            one.robot_id,
            one.at,
            one.x or 0.0,
            one.y or 0.0,
            one.probability,
            one.class_ or "",
            one.person_id,
        )
        for one in desk.records(DetectionRecord)
    ]
    braking = {name: robot.profile.braking for name, robot in desk.world.robots.items()}
    told = {name: poses_of(rows) for name, rows in poses.items()}
    return Inputs(told, sightings_of(seen), braking)


def decided(desk: Desk) -> list[tuple[str, str, float, float]]:
    """Robot, reason, begin and end of each decision, since the start (s)."""
    newest = {one.decision_id: one for one in desk.records(DecisionRecord)}
    return sorted(
        (
            one.robot_id,
            one.reason or "",
            one.started_at - START.wall,
            (one.ended_at or math.inf) - START.wall,
        )
        for one in newest.values()
    )


class Aisle:
    """AGI drives up and down an aisle, AGII stands far away and sees who is in it.

    Poses and pictures come as seldom as the history keeps them, so that nothing of the
    inputs is lost; robots fall silent, and pictures miss people.
    """

    def __init__(self, seed: int, least: float = 0.8) -> None:
        self.desk, self._random = Desk(), random.Random(seed)  # noqa: S311 - no secret
        self._x, self._yaw, self._least = 0.0, 0.0, least
        self._person, self._goes = 12.0, 0.4
        self._silent_until = self._blind_until = 0.0

    def run(self, seconds: float) -> None:
        for step in range(round(seconds / 0.05)):
            self.desk.clock.now = round(0.05 * step, 6)
            if step % 10 == 0:
                self._half_second(self.desk.clock.now)
            self.desk.loop.step([], self.desk.clock())

    def _half_second(self, now: float) -> None:
        chance, desk = self._random.random(), self.desk
        if chance < 0.01:
            self._silent_until = now + self._random.uniform(1.0, 5.0)
        elif chance < 0.04:
            self._blind_until = now + self._random.uniform(1.0, 4.0)
        speed = 0.4 if self._yaw == 0.0 else 0.6
        self._x += 0.5 * speed * math.cos(self._yaw)
        if not 0.0 <= self._x <= 20.0:
            self._yaw = math.pi if self._x > 20.0 else 0.0
        self._person += 0.5 * self._goes
        if not 5.0 <= self._person <= 15.0:
            self._goes = 0.4 if self._person < 5.0 else -0.4
        if now >= self._blind_until:
            sure = self._random.uniform(self._least, 1.0)
            desk.look("AGII", detection("farmer", self._person, probability=sure))
        if now >= self._silent_until:
            self._say("AGI", self._x, self._yaw, speed)
        self._say("AGII", 60.0, 0.0, 0.0)

    def _say(self, robot_id: str, x: float, yaw: float, speed: float) -> None:
        origin = self.desk.next_origin()
        self.desk.hear(odometry(robot_id, x, 0.0, yaw, linear=speed, origin=origin))


@cache
def ran(seed: int) -> Aisle:
    """What happened in an aisle in 165 s."""
    aisle = Aisle(seed)
    aisle.run(165.0)
    return aisle


def would(judged: Range, tried: Parameters) -> list[tuple[str, str, float, float]]:
    """The same as ``decided``, of a judgement by what was kept."""
    return sorted(
        (one.robot_id, one.reason, STEP_S * one.first, STEP_S * one.end)
        for one in judged.judge(tried)
    )


def lasting(
    found: list[tuple[str, str, float, float]],
) -> list[tuple[str, str, float, float]]:
    """Those of the whole range that were more than a touch between two looks."""
    return [one for one in found if one[2] < 160.0 and one[3] - one[2] > 1.2]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_with_the_parameters_in_force_it_is_what_was_decided(seed: int) -> None:
    aisle = ran(seed)
    judged = Range(inputs_of(aisle.desk), START.wall, START.wall + 165.0)

    was, now = lasting(decided(aisle.desk)), lasting(would(judged, Parameters()))

    assert len(was) >= 4
    assert [one[:2] for one in now] == [one[:2] for one in was]
    for (*_, first, end), (*_, began, ended) in zip(now, was, strict=True):
        assert first == pytest.approx(began, abs=BEGINS_S)
        assert end == pytest.approx(ended, abs=ENDS_S)


def test_of_many_faint_looks_the_time_is_right_to_a_tenth() -> None:
    aisle = Aisle(1, least=0.7)
    aisle.run(165.0)
    judged = Range(inputs_of(aisle.desk), START.wall, START.wall + 165.0)

    was = sum(end - began for *_, began, end in lasting(decided(aisle.desk)))
    now = sum(end - began for *_, began, end in lasting(would(judged, Parameters())))

    assert now == pytest.approx(was, rel=0.1)


def test_many_at_once_are_each_alone() -> None:
    judged = Range(inputs_of(ran(3).desk), START.wall, START.wall + 165.0)
    tried = [
        Parameters(*one)
        for one in product((0.8, 0.85, 0.95), (0.8,), (1.0, 2.5), (0.3, 1.0))
    ] + [Parameters(foresight_s=one) for one in (0.0, 1.0, 3.0)]

    together = judged.judge_all(tried)

    assert len({tuple(found) for found in together.values()}) > 5
    assert [together[one] for one in tried] == [judged.judge(one) for one in tried]


def test_a_range_in_parts_is_the_whole_range() -> None:
    inputs = inputs_of(ran(2).desk)
    whole = outcome_of(Range(inputs, START.wall, START.wall + 160.0), Parameters())
    parts = [
        outcome_of(Range(inputs, START.wall + since - lead, until), Parameters(), lead)
        for since, until, lead in (
            (0.0, START.wall + 60.0, 0.0),
            (60.0, START.wall + 160.0, 60.0),
        )
    ]

    assert parts[0] + parts[1] == whole


_PEOPLE = st.lists(
    st.tuples(
        st.sampled_from((-2.0, 3.0, 6.0, 11.0)),
        st.sampled_from((0.3, 0.55, 0.7, 0.85, 0.97)),
    ),
    max_size=3,
    unique_by=lambda one: one[0],
)
"""Where somebody stands, and how sure each look at them is."""


def scene(people: Sequence[tuple[float, float]], speed: float) -> Range:
    """AGI drives along an aisle in which people stand; AGII comes towards it."""
    moments = np.arange(0.0, 20.0, 0.5).tolist()
    poses = {
        "AGI": poses_of([(at, speed * at, 0.0, 0.0, speed, 0.01) for at in moments]),
        "AGII": poses_of(
            [(at, 9.0 - speed * at, 3.0, math.pi, speed, 0.0) for at in moments]
        ),
    }
    seen: list[SeenRow] = [
        ("AGII", at, x, 1.0, sure, "person", None)
        for at in moments
        for x, sure in people
    ]
    return Range(Inputs(poses, sightings_of(seen), BRAKING), 0.0, 20.0)


def slow_steps(judged: Range, tried: Parameters) -> set[tuple[str, int]]:
    return {
        (one.robot_id, step)
        for one in judged.judge(tried)
        for step in range(one.first, min(one.end, judged.steps))
    }


@given(_PEOPLE, st.sampled_from((0.0, 0.4, 1.0)), st.sampled_from((0.0, 1.0, 3.0)))
def test_a_smaller_radius_never_slows_more(
    people: list[tuple[float, float]], speed: float, foresight_s: float
) -> None:
    judged, rule = scene(people, speed), Parameters(foresight_s=foresight_s)
    found = [
        slow_steps(judged, replace(rule, radius_m=r)) for r in (0.5, 1.0, 2.0, 6.0)
    ]

    assert all(less <= more for less, more in pairwise(found))


@given(_PEOPLE, st.sampled_from((0.0, 0.4, 1.0)))
def test_of_people_who_are_seen_alike_a_lower_threshold_never_slows_less(
    people: list[tuple[float, float]], speed: float
) -> None:
    judged = scene(people, speed)
    found = [
        slow_steps(judged, Parameters(threshold=t)) for t in (0.99, 0.9, 0.8, 0.6, 0.2)
    ]

    assert all(less <= more for less, more in pairwise(found))


@given(_PEOPLE, st.sampled_from((0.4, 1.0)))
def test_more_hysteresis_and_a_farther_horizon_never_slow_less(
    people: list[tuple[float, float]], speed: float
) -> None:
    judged, plain = scene(people, speed), Parameters(foresight_s=1.0)
    found = [
        slow_steps(judged, one)
        for one in (
            replace(plain, foresight_s=0.0),
            plain,
            replace(plain, foresight_s=3.0),
            replace(plain, foresight_s=3.0, release_beyond_m=1.0),
            replace(plain, foresight_s=3.0, release_beyond_m=1.0, release_after_s=3.0),
        )
    ]

    assert all(less <= more for less, more in pairwise(found))


def test_slowed_time_lost_time_and_near_misses_are_counted() -> None:
    moments = np.arange(0.0, 20.0, 0.5).tolist()
    poses = {"AGI": poses_of([(at, at, 0.0, 0.0, 1.0, 0.0) for at in moments])}
    seen = sightings_of(
        [("AGI", at, 10.0, 0.0, 0.85, "person", "P1") for at in moments]
    )
    judged = Range(Inputs(poses, seen, BRAKING), 0.0, 20.0)

    held = outcome_of(judged, Parameters(release_after_s=0.0, foresight_s=0.0))
    blind = outcome_of(judged, Parameters(threshold=0.999, factor=0.3))

    assert held.encounters == {"person": 1}
    assert held.slowed_s["person"] == pytest.approx(4.5, abs=0.5)
    assert held.lost_s == pytest.approx(0.5 * held.slowed_s["person"])
    assert (held.near_misses, held.near_s) == (0, 0.0)
    assert blind == Outcome({"person": 0.0, "robot": 0.0}, {}, 1, blind.near_s, 0.0)
    assert blind.near_s == pytest.approx(4.5, abs=0.2)


def test_against_the_truth_missed_people_and_false_alarms_are_counted() -> None:
    moments = np.arange(0.0, 20.0, 0.5).tolist()
    poses = {"AGI": poses_of([(at, at, 0.0, 0.0, 1.0, 0.0) for at in moments])}
    # One is seen at 10 m, where nobody is; another at 15 m is seen by nobody.
    seen = sightings_of(
        [("AGI", at, 10.0, 0.0, 0.85, "person", "P1") for at in moments]
    )
    truth = {"AGI": nearest_of([(at, abs(15.0 - at)) for at in moments])}
    judged = Range(Inputs(poses, seen, BRAKING), 0.0, 20.0, truth)
    quick = Parameters(release_after_s=0.0, foresight_s=0.0)

    found = outcome_of(judged, quick)
    blind = outcome_of(judged, replace(quick, threshold=0.999))
    unknown = outcome_of(Range(judged.inputs, 0.0, 20.0), quick)

    # From 13 to 17.4 s it is near the one, from 8 to 12.3 s slow for the other.
    assert found.missed_s == pytest.approx(4.4, abs=0.6)
    assert found.false_s == pytest.approx(4.3, abs=0.6)
    assert (blind.missed_s, blind.false_s) == (found.missed_s, 0.0)
    assert (unknown.missed_s, unknown.false_s) == (None, None)
    assert (found + unknown).missed_s == found.missed_s


def test_of_nothing_comes_nothing() -> None:
    nothing = Range(Inputs({}, sightings_of([]), {}), 0.0, 60.0)

    assert list(nothing.judge(Parameters())) == []
    assert outcome_of(nothing, Parameters()) == Outcome()
