"""What holds for a robot is told in one order, in the colour of the gravest."""

from dataclasses import replace
from typing import Any

import pytest

from iveg.domain.events import Condition
from iveg.domain.feedback import SpeedLimit
from iveg.domain.rule.clear import ClearCondition
from iveg.domain.situation import ALERTED, ORDER, Near, situation_alerts, situation_of
from tests.builders import safety_report
from tests.staged import AISLE_3, HALF, TOLD, facts, p1


def alerts(*keys: str) -> list[Condition]:
    """These hold at once, raised in another order than they are told."""
    return situation_alerts(one for key in reversed(keys) for one in p1(f"alert.{key}"))


LASER = Near("obstacle", None, 0.9)
PERSON = {"report": HALF, "limit": TOLD, "near": AISLE_3, "limit_near": AISLE_3}
OBSTACLE = {
    "report": safety_report("AGI", speed_factor=0.5, reason="obstacle"),
    "near": LASER,
}
LOST = {"link": "LOST", "age_s": 4.0, "stop": "UNCONFIRMED"}
FALLING: list[tuple[str, dict[str, Any]]] = [
    ("disobeys", {"alerts": alerts("person_not_slowing", "another_iveg")}),
    (
        "lost_moving",
        {"alerts": alerts("moving_robot_lost", "stop_unconfirmed"), **LOST},
    ),
    ("stop_failed", {"alerts": alerts("another_iveg"), "stop": "UNCONFIRMED"}),
    ("stop_unknown", {"alerts": alerts("another_iveg"), "stop": "STALE"}),
    ("stop_under_way", {"alerts": alerts("another_iveg"), "stop": "SENT"}),
    ("moved", {"alerts": alerts("stop_moved", "another_iveg"), "stop": "SENT"}),
    ("another_iveg", {"alerts": alerts("another_iveg"), "doubts": ("jumped",)}),
    ("contradiction", {"doubts": ("jumped",), "out_of_service_by": "Ana", **PERSON}),
    ("blind", {"out_of_service_by": "Ana", **PERSON}),
    ("blind", {"alerts": alerts("camera_blind"), **PERSON}),
    ("blind", {"unmet": (ClearCondition("detector", "AGI"),), **PERSON}),
    ("person", {"unmet": (ClearCondition("detector", "AGII"),), **PERSON}),
    ("person", {"alerts": alerts("battery_low"), **PERSON}),
    ("laser", {"alerts": alerts("battery_low"), **OBSTACLE}),
    ("locked", {"alerts": alerts("battery_low"), "stop": "STANDING"}),
    ("battery", {"alerts": alerts("battery_low")}),
    ("working", {}),
]


@pytest.mark.parametrize(("kind", "holding"), FALLING)
def test_the_first_in_order_is_told(kind: str, holding: dict[str, Any]) -> None:
    assert situation_of(facts(**holding)).kind == kind


def test_the_alerts_of_situations_stand_in_their_order() -> None:
    places = [list(ORDER).index(kind) for kind, *_ in ALERTED.values()]

    assert places == sorted(places)


def test_a_doubt_that_is_told_first_has_the_colour_of_what_is_graver() -> None:
    stale = facts(alerts=alerts("another_iveg"), stop="STALE")

    assert situation_of(stale).level == "danger"
    assert situation_of(replace(stale, alerts=())).level == "doubt"


@pytest.mark.parametrize("reason", ["stale", "person"])
def test_a_robot_without_a_camera_is_never_clear(reason: str) -> None:
    limit = SpeedLimit(0.5, reason)
    for known in (
        facts(out_of_service_by="Ana"),
        facts(out_of_service_by="Ana", stands=True),
        facts(out_of_service_by="Ana", limit=limit),
    ):
        found = situation_of(known)
        assert (found.kind, found.action) == ("blind", "check_camera")
    locked = facts(out_of_service_by="Ana", stop="STANDING", stands=True)
    assert situation_of(locked).action == "release"
