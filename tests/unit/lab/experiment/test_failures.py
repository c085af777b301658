"""What goes wrong in the field test, and which run it ends."""

from dataclasses import replace

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.scripts import Incident
from iveg.lab.experiment import virtual_run
from iveg.lab.experiment.failures import FAILURES, FailureModel, drawn
from iveg.lab.experiment.plan import ROBOTS, PlannedRun
from iveg.lab.experiment.virtual_run import VirtualRun

STEP = PlannedRun("nlos-field", 1, 0.0, 7, profile="simulation", fails=True)


def test_the_same_seed_fails_in_the_same_way() -> None:
    model = FailureModel(2.0, 2.0)
    assert drawn(model, ROBOTS, 60.0, 7) == drawn(model, ROBOTS, 60.0, 7)
    assert drawn(model, ROBOTS, 60.0, 7) != drawn(model, ROBOTS, 60.0, 8)


def test_failures_are_as_frequent_as_their_model_says() -> None:
    model, minutes = FAILURES["field"], 2000
    found = drawn(model, ROBOTS, 60.0 * minutes, 1)

    stuck = sum(one.order.stuck is True for one in found)
    began = [one.at_s for one in found if one.order.mute is True]
    ended = [one.at_s for one in found if one.order.mute is False]
    assert stuck / minutes / 2 == pytest.approx(model.gives_up, rel=0.2)
    assert len(began) / minutes / 2 == pytest.approx(model.gaps, rel=0.1)
    assert (sum(ended) - sum(began)) / len(began) == pytest.approx(model.gap_s, rel=0.1)
    simulated = drawn(FAILURES["simulation"], ROBOTS, 60.0 * minutes, 1)
    assert {one.order.mute for one in simulated} == {None}


async def failed(
    monkeypatch: pytest.MonkeyPatch, *incidents: Incident, seconds: float = 9.0
) -> list[str]:
    monkeypatch.setattr(virtual_run, "drawn", lambda *_: incidents)
    result = await VirtualRun(STEP, DetectionRule()).play(seconds)
    assert result.completed is not bool(result.failures)
    return result.failures


def mute(at_s: float, *, on: bool) -> Incident:
    return Incident(at_s, FaultOrder(robot="AGII", mute=on))


@pytest.mark.parametrize(
    ("incidents", "reasons"),
    [
        ((), []),
        ((Incident(2.0, FaultOrder(robot="AGII", stuck=True)),), ["navigation"]),
        ((mute(1.0, on=True), mute(4.0, on=False)), []),
        ((mute(1.0, on=True), mute(8.0, on=False)), ["link"]),
        ((mute(7.0, on=True),), ["link"]),
    ],
)
async def test_a_run_fails_by_what_ended_it(
    monkeypatch: pytest.MonkeyPatch,
    incidents: tuple[Incident, ...],
    reasons: list[str],
) -> None:
    assert await failed(monkeypatch, *incidents) == reasons


async def test_a_robot_that_gave_up_stands() -> None:
    run = VirtualRun(replace(STEP, profile="field", fails=False), DetectionRule())
    run.happen(FaultOrder(robot="AGII", stuck=True))

    result = await run.play(4.0)

    assert {row["wanted"] for row in result.truth if row["robot"] == "AGII"} == {0.0}
    assert result.failures == ["navigation"]
