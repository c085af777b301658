"""Tiles of other equipment: numbers, limits, silence, and what cannot be read."""

from dataclasses import replace
from typing import Any

import pytest

from iveg.domain.equipment import Equipment, Limit, State, Tile
from iveg.domain.observations import Instant

START = Instant(100.0, 1_000_000.0)
TILE = Tile(
    entity_id="unit",
    entity_type="Unit",
    attribute="ec",
    name={"es": "CE", "en": "EC"},
    unit="mS/cm",
    limits={"low_low": 0.5, "low": 1.0, "high": 3.5, "high_high": 4.5},
    deadband=0.1,
)
ACIDITY = replace(TILE, attribute="ph", unit="pH", limits={})


def at(seconds: float) -> Instant:
    return START.later(seconds)


def told(*values: Any) -> tuple[Equipment, list[State]]:
    """One value a second, and the state after each."""
    equipment, states = Equipment([TILE, ACIDITY], START), []
    for second, value in enumerate(values):
        equipment.read("unit", {"ec": value}, at(second))
        states.append(equipment.state(TILE, at(second)))
    return equipment, states


def test_a_limit_lets_go_only_inside_its_deadband() -> None:
    _, states = told(3.6, 3.45, 3.39, 3.45, 4.6, 4.45, 4.39)

    assert states == ["high", "high", "ok", "ok", "high_high", "high_high", "high"]


@pytest.mark.parametrize(
    "value", ["2.1", True, {"x": 1}, [2.1], float("nan"), float("inf"), 10**400]
)
def test_what_is_no_number_is_unreadable_and_the_last_number_stays(value: Any) -> None:
    equipment, states = told(2.1, value)

    assert states == ["ok", "unreadable"]
    assert equipment.status(TILE).value == 2.1
    assert equipment.status(TILE).received == at(0)
    [wrong] = equipment.conditions(at(1))
    assert (wrong.priority, wrong.key) == ("P3", "alert.tile_unreadable")


def test_a_tile_that_loses_its_signal_is_silent_alone() -> None:
    equipment, _ = told(2.1)
    equipment.read("unit", {"ph": 6.0, "ec": None}, at(299.0))

    assert equipment.state(TILE, at(300.0)) == "ok"
    assert equipment.state(TILE, at(300.1)) == "silent"
    assert equipment.state(ACIDITY, at(300.1)) == "ok"
    [wrong] = equipment.conditions(at(300.1))
    assert (wrong.priority, wrong.key) == ("P3", "alert.tile_silent")
    assert (wrong.slots["minutes"], wrong.slots["tile_en"]) == (5.0, "EC")


@pytest.mark.parametrize(
    ("value", "priority", "key", "limit"),
    [
        (0.4, "P2", "alert.tile_low", "low_low"),
        (0.9, "P3", "alert.tile_low", "low"),
        (3.6, "P3", "alert.tile_high", "high"),
        (4.6, "P2", "alert.tile_high", "high_high"),
    ],
)
def test_a_limit_is_an_alert_that_names_it(
    value: float, priority: str, key: str, limit: Limit
) -> None:
    equipment, _ = told(value)

    [wrong] = equipment.conditions(at(1))

    assert (wrong.priority, wrong.key) == (priority, key)
    assert (wrong.slots["limit"], wrong.slots["unit"]) == (TILE.limits[limit], "mS/cm")
