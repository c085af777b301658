"""The trial of a rule: what it compares, how it begins, lasts and ends."""

from dataclasses import replace

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import WordAnswer
from iveg.domain.errors import OutdatedError, TrialRefusedError
from iveg.domain.parameters import ByClass
from iveg.domain.rule.trial import Trial
from iveg.pipeline import Pipeline
from tests.builders import detection
from tests.faulty_world import Faults
from tests.stage import Stage
from tests.unit.vital.desk import Desk
from tests.unit.web.desk import WebDesk

RULE = DetectionRule()
STRICT, LAX = (
    replace(RULE, threshold=ByClass(0.5)),
    replace(RULE, threshold=ByClass(0.95)),
)


def begin(parts: Pipeline, rule: DetectionRule, desk: Desk) -> None:
    trial = Trial(rule, "ana", desk.clock().wall)
    parts.trials.start(trial, desk.clock())


def trial_of(desk: Desk) -> Trial:
    trial = desk.parts.trials.current
    assert trial is not None
    return trial


async def test_the_rule_in_force_tried_beside_itself_makes_no_difference() -> None:
    """Among people, with faults that a robot can have."""
    stage = Stage("demo", profile="field")
    await stage.step()
    begin(stage.parts, RULE, stage.desk)
    for robot_id, faults in (
        ("AGI", Faults(mute=True)),
        ("AGI", Faults(clock_offset_s=3.0)),
        ("AGII", Faults(hide_people=True, deaf=True)),
        ("AGII", Faults()),
    ):
        for _ in range(400):
            await stage.step()
        stage.happen(robot_id, faults)

    trial = trial_of(stage.desk)
    told = trial.so_far
    assert told is not None
    assert (trial.differences, told.would_slow, told.would_not) == ((), 0, 0)
    assert told.in_force == told.candidate
    assert told.in_force.slowed_s["person"] > 5.0
    assert told.in_force.encounters["person"] > 2
    assert told.in_force.slowed_s["stale"] > 1.0, "a mute robot"
    assert told.compared_s == pytest.approx(78.0, abs=0.2)


def watch(desk: Desk, x: float, *certain: float) -> None:
    """A tenth of a second: AGII sees people, and AGI drives elsewhere than they are."""
    desk.clock.now = round(desk.clock.now + 0.1, 6)
    desk.drive("AGI", 0.0, linear=0.0)
    desk.drive("AGII", 50.0, linear=0.0)
    desk.look("AGI")
    desk.look("AGII", *(detection("farmer", x, probability=p) for p in certain))
    desk.loop.step([], desk.clock())


def test_who_is_too_faint_for_the_rule_in_force_slows_by_a_lower_threshold() -> None:
    desk = Desk()
    begin(desk.parts, STRICT, desk)
    for _ in range(25):
        watch(desk, 1.5)
    began = desk.clock().wall
    for _ in range(3):
        watch(desk, 1.5, 0.6)

    [one] = trial_of(desk).differences
    assert (one.robot_id, one.kind, one.reason) == ("AGI", "slows", "person")
    assert (one.decision_id, one.ended) == (None, None)
    assert one.began == pytest.approx(began + 0.1)


def test_a_word_that_an_operator_called_a_person_is_one_for_the_candidate() -> None:
    desk = Desk()
    desk.world.word_answers.add(WordAnswer("AGII", "tractor", True, "ana", 0.0))
    begin(desk.parts, replace(RULE, radius_m=ByClass(3.0)), desk)
    for _ in range(25):
        watch(desk, 2.5)
    desk.look("AGII", detection("tractor_3", 2.5))
    desk.loop.step([], desk.clock())

    told = [(one.robot_id, one.reason) for one in trial_of(desk).differences]
    assert told == [("AGI", "person")]


def test_who_is_sure_enough_for_the_rule_in_force_alone_frees() -> None:
    desk = Desk()
    begin(desk.parts, LAX, desk)
    for number in range(80):
        watch(desk, 1.5, *([0.85] if 25 <= number < 30 else []))

    trial = trial_of(desk)
    told = trial.so_far
    assert told is not None
    assert {one.kind for one in trial.differences} == {"frees"}
    first = trial.differences[0]
    assert first.decision_id is not None
    assert first.cause == "P1"
    assert first.ended is not None
    assert first.ended > first.began
    assert told.would_not == len(trial.differences)
    assert told.in_force.encounters == {"person": 1}
    # By the candidate it takes some looks until somebody is sure enough.
    later = told.in_force.slowed_s["person"] - told.candidate.slowed_s["person"]
    spans = [(one.ended or 0.0) - one.began for one in trial.differences]
    assert later == pytest.approx(sum(spans), abs=0.01)
    assert later == pytest.approx(0.3, abs=0.01)


def test_a_trial_that_cannot_judge_ends_and_is_named() -> None:
    desk = Desk()
    begin(desk.parts, replace(RULE, radius_m="wide"), desk)  # type: ignore[arg-type]
    watch(desk, 1.5, 0.9)

    assert desk.parts.trials.current is None
    assert desk.parts.core.supervision.counters["comfort_failed.shadow-rule"] == 1
    assert desk.evaluator.speed_limits["AGI"].speed_factor == 0.5


async def test_an_operator_begins_ends_and_promotes() -> None:
    desk = WebDesk()
    trials, at = desk.parts.trials, desk.clock()
    with pytest.raises(TrialRefusedError, match="none"):
        trials.end()
    with pytest.raises(TrialRefusedError, match="same"):
        trials.begin(replace(RULE, version=7, author="ben"), "ana", at)
    trials.begin(LAX, "ana", at)
    with pytest.raises(TrialRefusedError, match="running"):
        trials.begin(STRICT, "ben", at)
    for number in range(40):
        watch(desk, 1.5, *([0.85] if number >= 25 else []))
    with pytest.raises(OutdatedError):
        await trials.promote("eva", desk.clock(), 9)
    tried = trials.current
    assert tried is not None

    rule = await trials.promote("eva", desk.clock(), 1)

    assert (rule.version, rule.threshold.every, rule.author) == (2, 0.95, "eva")
    assert rule.comparison == tried.so_far
    assert rule.comparison is not None
    assert rule.comparison.would_not > 0
    assert desk.rule_store.written == [rule]
    assert desk.parts.trials.current is None
