"""Every scenario on the virtual clock: what it promises is seen in iVeg.

Two of them, ``nlos`` and ``link-loss``, are also played in real time through the whole
running stack: ``tests/integration/test_scenarios.py``.
"""

import math
from functools import partial
from typing import Any

import pytest

from iveg.lab.emulator.scenarios import SCENARIOS
from tests.stage import Json, Stage, links_of

CRUISE = 0.8
"""Of AGI and AGII where nobody slows them (m/s)."""
SILENCE_S = 5.0
"""How long nobody hears AGII in ``link-loss``."""
CROWD = ("AGI", "AGII", "AG3")
LINKS = ["detection", "filter", "geometry", "rule", "feedback", "applied", "observed"]
PLAYED = (
    *("nlos", "nlos-field", "link-loss", "deaf", "viewpoints", "noisy-crossing"),
    *("occluded", "peers", "together", "many", "demo", "coat"),
)


def near(position: Json, x: float, y: float, within_m: float = 0.6) -> bool:
    return math.dist((position["x"], position["y"]), (x, y)) <= within_m


def near_robot(stage: Stage, robot_id: str, x: float, y: float) -> bool:
    """Whether a robot is inside a ring around a place."""
    pose = stage.robot(robot_id)["pose"]
    return pose is not None and math.dist((pose["x"], pose["y"]), (x, y)) <= 2.0


def test_every_scenario_is_held_to_its_outcome() -> None:
    assert set(PLAYED) == set(SCENARIOS)


@pytest.mark.parametrize("scenario", ["nlos", "nlos-field"])
async def test_agii_slows_for_a_person_whom_only_agi_sees(scenario: str) -> None:
    stage = Stage(scenario)

    decision = await stage.first(
        lambda: [d for d in stage.decisions("AGII", "person") if d.applied_at],
        "AGII says that it slows for a person",
    )
    line = await stage.first(
        lambda: stage.log("AGII", "log.speed_down.person"), "the log says so"
    )
    await stage.until(
        lambda: 0.0 < stage.speed("AGII") <= 0.55 * CRUISE, "its odometry shows it"
    )

    assert (decision.observer, decision.in_sight) == ("AGI", False)
    assert line["key"] == "log.speed_down.person_nlos"
    assert (line["slots"]["observer"], line["slots"]["in_sight"]) == ("AGI", False)


async def test_a_coat_slows_agii_each_round_until_it_is_marked_as_no_person() -> None:
    stage = Stage("coat")
    at_coat = partial(near_robot, stage, "AGII", 11.5, 9.0)
    await stage.until(lambda: stage.decisions("AGII", "person"), "AGII slows for it")
    (coat,) = {one["person_id"] for one in stage.people()}
    await stage.until(at_coat, "AGII passes it")
    await stage.until(lambda: not at_coat(), "AGII drives on")

    stage.mark(coat)
    await stage.until(at_coat, "AGII passes it again", 200.0)
    await stage.until(lambda: not at_coat(), "AGII drives on")

    about_it = [
        one for one in stage.decisions("AGII", "person") if one.person_id == coat
    ]
    assert len(about_it) == 1
    assert coat in {one["person_id"] for one in stage.people()}


async def test_a_robot_that_judges_ahead_of_iveg_is_timed_too() -> None:
    # Whom it foresees it knows already: nobody is noticed anew.
    stage = Stage("nlos", foresight=False)

    await stage.until(lambda: stage.decisions("AGII", "person"), "AGII slows")
    told = stage.safety()["alert_latency"]

    assert told["count"] == 1
    assert 0.0 < told["p50_ms"] <= 250.0


async def test_an_encounter_is_told_with_its_place_before_the_ring_is_entered() -> None:
    stage = Stage("nlos")

    def apart() -> float:
        pose, [someone] = stage.robot("AGII")["pose"], stage.people()
        place = someone["position"]
        return math.hypot(pose["x"] - place["x"], pose["y"] - place["y"])

    foretold = await stage.first(
        lambda: stage.robot("AGII")["encounters"], "an encounter ahead of AGII"
    )
    told_at, away = stage.now.mono, apart()
    await stage.until(lambda: apart() <= foretold["radius_m"], "AGII is there")
    pose, place = stage.robot("AGII")["pose"], foretold["place"]

    assert away > foretold["radius_m"]
    assert 1.5 <= stage.now.mono - told_at <= 2 * foretold["in_s"] + 0.5
    assert math.hypot(pose["x"] - place["x"], pose["y"] - place["y"]) <= 0.3
    [met] = stage.decisions("AGII", "person")
    assert met.rule_parameters["foretold_s"] > 0.0
    await stage.until(
        lambda: not stage.robot("AGII")["encounters"], "it is no forecast any more", 0.5
    )


async def test_agii_in_the_corridor_looks_away_and_comes_nearer_in_reverse() -> None:
    stage = Stage("nlos-field")

    await stage.until(lambda: stage.decisions("AGII", "person"), "AGII slows")

    agii = stage.robot("AGII")
    assert abs(abs(agii["pose"]["yaw"]) - math.pi) < 0.3
    assert agii["twist"]["linear"] < 0.0


async def test_a_robot_that_is_not_heard_is_late_then_lost_and_has_stopped_itself() -> (
    None
):
    stage = Stage("link-loss")
    await stage.until(lambda: stage.robot("AGII")["link"] == "LATE", "AGII is LATE")
    before = stage.robot("AGII")
    await stage.until(lambda: stage.robot("AGII")["link"] == "LOST", "AGII is LOST")
    await stage.until(lambda: stage.log("AGII", "log.alert.raised"), "an alert")
    await stage.until(lambda: stage.robot("AGII")["link"] == "LIVE", "AGII is back")
    back = stage.robot("AGII")

    held = await stage.until(
        lambda: [hold["source"] for hold in stage.robot("AGII")["holds"]],
        "AGII says what holds it",
    )
    driven = abs(before["pose"]["y"] - back["pose"]["y"])
    assert held == ["link"]
    assert abs(back["twist"]["linear"]) < 0.02
    assert driven < 0.6 * before["twist"]["linear"] * SILENCE_S

    await stage.until(lambda: not stage.robot("AGII")["holds"], "its hold goes")
    await stage.until(lambda: stage.speed("AGII") > 0.2, "it drives on")


async def test_a_deaf_robot_raises_an_alert_within_two_seconds() -> None:
    stage = Stage("deaf")

    alert = await stage.first(
        lambda: [a for a in stage.alerts() if a["key"] == "alert.person_not_slowing"],
        "iVeg notices that AGII does not slow",
    )

    [ignored] = [
        one
        for one in stage.decisions("AGII", "person")
        if one.decision_id == alert["slots"]["decision"]
    ]
    waited = stage.now.wall - ignored.started_at
    assert (alert["priority"], alert["robot_id"]) == ("P1", "AGII")
    assert 2.0 <= waited <= 3.0
    assert ignored.observed_at is None


async def test_a_person_is_one_person_from_south_and_north() -> None:
    stage = Stage("viewpoints")
    seen: set[bool] = set()
    at_once: list[int] = []

    def seen_from_both_sides() -> bool:
        here = [one for one in stage.people() if near(one["position"], 10.0, 10.0)]
        at_once.append(len(here))
        if any(one["age_s"] < 0.5 for one in here):
            seen.add(stage.robot("AGI")["pose"]["y"] > 10.0)
        return seen == {False, True}

    await stage.until(seen_from_both_sides, "AGI sees the person from both sides")

    # Out of sight for more than ten seconds, so under a new name; never under two.
    assert max(at_once) == 1


async def test_noise_about_the_threshold_slows_once_a_crossing() -> None:
    stage = Stage("noisy-crossing")
    await stage.until(
        lambda: any(d.ended_at for d in stage.decisions("AGI", "person")),
        "AGI has met the person and left",
    )
    await stage.until(lambda: stage.robot("AGI")["pose"]["y"] > 12.8, "AGI is past")

    assert len(stage.decisions("AGI", "person")) == 1
    assert len(stage.log("AGI", "log.speed_down.person")) == 1


async def test_robots_that_pass_each_other_both_slow() -> None:
    stage = Stage("peers")

    agi = await stage.first(lambda: stage.decisions("AGI", "robot"), "AGI slows")
    agii = await stage.first(lambda: stage.decisions("AGII", "robot"), "AGII slows")

    assert (agi.person_id, agii.person_id) == ("AGII", "AGI")
    assert agi.speed_factor == agii.speed_factor == 0.5


async def test_a_person_at_the_end_of_a_row_is_less_certain_and_still_slows_agi() -> (
    None
):
    stage = Stage("occluded")
    decision = await stage.first(
        lambda: [d for d in stage.decisions("AGI", "person") if d.applied_at],
        "AGI slows for the person",
    )

    first = stage.detections("AGI", "person")[0]
    assert near({"x": first.x, "y": first.y}, 11.9, 17.2)
    assert first.probability == pytest.approx(0.90, abs=0.01)
    assert decision.confidence == pytest.approx(0.95, abs=0.01)


async def test_one_look_holds_a_person_and_a_peer() -> None:
    stage = Stage("together")

    def both() -> dict[str, Any]:
        look = stage.look("AGI")
        return look if {"farmer", "AGII"} <= set(look) else {}

    seen = await stage.until(both, "AGI sees both at once")

    assert seen["farmer"]["confident"] is True
    assert seen["farmer"]["person_id"] is not None
    assert seen["AGII"]["class"] == "robot"
    assert seen["AGII"]["person_id"] is None


async def test_many_robots_are_live_and_drive() -> None:
    stage = Stage("many", CROWD)

    for robot_id in CROWD:
        await stage.until(
            lambda name=robot_id: stage.speed(name) > 0.25,  # type: ignore[misc]
            f"{robot_id} drives",
        )

    assert stage.log(None, "log.link.lost") == []
    assert [a for a in stage.alerts() if a["priority"] == "P1"] == []


@pytest.mark.slow
async def test_nearly_every_slow_down_of_the_demo_carries_every_link() -> None:
    stage = Stage("demo", profile="simulation", seed=1)

    def ended() -> list[dict[str, str]]:
        of = [*stage.decisions("AGI", "person"), *stage.decisions("AGII", "person")]
        of += [*stage.decisions("AGI", "robot"), *stage.decisions("AGII", "robot")]
        over = [links_of(one) for one in of if one.ended_at is not None]
        return over if len(over) >= 10 else []

    over = await stage.until(ended, "ten decisions that ended", within_s=600.0)

    broken = [
        links
        for links in over
        if list(links) != LINKS or {"missing", "open"} & set(links.values())
    ]
    assert len(broken) <= 0.05 * len(over), broken
