"""One truth a robot: whatever happens, its situation contradicts nothing beside it."""

from typing import Any

from hypothesis import example, given, settings

from iveg.domain.limits import LIMITS
from tests.worlds import days, told

Robot = dict[str, Any]


def is_fresh(robot: Robot) -> bool:
    applied = robot["applied"]
    return applied is not None and applied["age_s"] <= LIMITS.report_stale_s


def contradictions(robot: Robot, *, alerted: bool) -> dict[str, bool]:
    """What must not be, by name."""
    found, link = robot["situation"], robot["link"]
    level, state, factor = found["level"], found["state"], found["factor"]
    fresh = is_fresh(robot)
    reason = robot["applied"]["reason"] if fresh else None
    silent = link in ("LOST", "UNKNOWN")
    return {
        "clear beside a link that is not": state == "clear" and link != "LIVE",
        "clear beside a lack": state == "clear" and bool(robot["missing"]),
        "clear that the robot does not say": state == "clear" and reason != "clear",
        "clear beside a limit": state == "clear" and factor != 1.0,
        "clear beside a lock": state == "clear" and fresh and bool(robot["holds"]),
        "half that it does not apply": state == "half" and factor != 0.5,
        "half that it does not say": state == "half" and robot["speed_factor"] != 0.5,
        "a reason that is not applied": state == "half" and found["cause"] != reason,
        "held without locks": state == "held" and not (fresh and robot["holds"]),
        "locked beside a limit": level == "locked" and factor != 0.0,
        "work beside silence": level in ("working", "locked") and silent,
        "silence without one": state in ("late", "lost") and link == "LIVE",
        "a P1 that is no danger": alerted and level != "danger" and silent,
        "danger without a P1": level == "danger" and not alerted,
        "a call to STOP without a P1": found["action"] == "press_stop" and not alerted,
        "a sentence of somebody that names no one": found["why"] == "person_in"
        and "lane" not in found["slots"],
    }


@settings(max_examples=60, deadline=None)
@given(days)
@example(
    [
        ("look", "AGI", []),
        ("healthy", 0.3, 0.0),
        ("report", "AGI", 0.3, "hold", (), 0.0),
    ]
)
def test_no_situation_contradicts_what_is_told_beside_it(
    day: list[tuple[Any, ...]],
) -> None:
    for moment in told(day):
        for robot in moment.robots:
            alerted = robot["robot_id"] in moment.alerted
            found = contradictions(robot, alerted=alerted)
            assert [name for name, holds in found.items() if holds] == [], robot


@settings(max_examples=15, deadline=None)
@given(days)
@example(
    [
        ("drive", "AGII", 0.0, 0.0),
        ("hold", "AGI"),
        ("report", "AGII", 0.0, "clear", (), 0.3),
        ("hold", "AGI"),
        ("hold", "AGI"),
        ("drive", "AGII", 0.0, 0.0),
    ]
)
def test_a_p1_of_a_robot_that_is_heard_is_its_situation(
    day: list[tuple[Any, ...]],
) -> None:
    *before, last = told([*day, ("wait", 0.1)])

    assert _levels_of_p1(last.robots, last.alerts) <= {"danger"}
    for moment in before:
        heard = {one["robot_id"] for one in moment.robots if one["link"] == "LIVE"}
        # Of who is heard again it is over with the next tick.
        held = [one for one in moment.alerts if one not in _lost(heard)]
        assert _levels_of_p1(moment.robots, held) <= {"danger"}


def _lost(robots: set[str]) -> set[tuple[str, str]]:
    return {(name, "alert.moving_robot_lost") for name in robots}


def _levels_of_p1(robots: list[Robot], alerts: list[tuple[str, str]]) -> set[str]:
    levels = {one["robot_id"]: one["situation"]["level"] for one in robots}
    return {levels[name] for name, _ in alerts}


def test_a_healthy_fleet_is_clear() -> None:
    """Else all of this would hold of a program that never says so."""
    last = told([("healthy", 2.5, 0.8)])[-1]

    assert [one["situation"]["state"] for one in last.robots] == ["clear", "clear"]
