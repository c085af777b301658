"""The evidence of every decision is among the detections that the history keeps."""

import pytest

from iveg.domain.records import DecisionRecord, DetectionRecord
from tests.builders import detection
from tests.stage import Stage
from tests.unit.vital.desk import Desk


def evidence_of(
    decision: DecisionRecord, kept: list[DetectionRecord]
) -> list[DetectionRecord]:
    """The rows that a reader finds by the decision's own keys."""
    return [
        one
        for one in kept
        if (one.robot_id, one.person_id, one.probability, one.x, one.y)
        == (
            decision.observer,
            decision.person_id,
            decision.confidence,
            decision.x,
            decision.y,
        )
    ]


def decisions_of(desk: Desk) -> list[DecisionRecord]:
    newest = {one.decision_id: one for one in desk.records(DecisionRecord)}
    return list(newest.values())


def look_on(desk: Desk, x: float, *, seconds: float, robot_id: str = "AGII") -> None:
    """Ten looks a second at a farmer; the last one is the surest."""
    for tenth in range(round(10 * seconds)):
        desk.clock.now = round(desk.clock.now + 0.1, 6)
        seen = detection("farmer", x, probability=0.8 + 0.001 * tenth)
        desk.look(robot_id, seen)


def test_a_look_between_two_rows_that_slows_a_robot_has_a_row() -> None:
    desk = Desk()
    desk.drive("AGI", 0.0)
    desk.drive("AGII", 50.0)
    look_on(desk, 5.0, seconds=0.8)
    desk.drive("AGI", 4.0)

    (decision,) = decisions_of(desk)
    (row,) = evidence_of(decision, desk.records(DetectionRecord))
    assert decision.confidence == pytest.approx(0.807)
    assert row.at == pytest.approx(desk.clock().wall)
    assert row.box is not None


def test_two_decisions_about_one_look_share_its_row() -> None:
    desk = Desk(("AGI", "AGII", "AG3"))
    desk.drive("AGI", 0.0)
    desk.drive("AGII", 50.0)
    desk.drive("AG3", 9.0)
    look_on(desk, 4.5, seconds=0.8)
    before = len(desk.records(DetectionRecord))
    desk.drive("AGI", 3.5)
    desk.drive("AG3", 5.5)

    told = [one for one in decisions_of(desk) if one.confidence is not None]
    assert {one.robot_id for one in told} == {"AGI", "AG3"}
    assert len(desk.records(DetectionRecord)) == before + 1


@pytest.mark.parametrize("scenario", ["nlos", "many"])
async def test_every_decision_of_a_scenario_has_its_evidence(scenario: str) -> None:
    stage = Stage(scenario)
    for _ in range(1200):
        await stage.step()

    decisions, kept = stage.kept()
    told = [one for one in decisions if one.confidence is not None]
    assert told
    assert [one.decision_id for one in told if not evidence_of(one, kept)] == []
