import json

import pytest

from iveg.domain.errors import UnreadableError
from iveg.lab.emulator.orders import (
    FaultOrder,
    OrderPlace,
    read_fault_arguments,
    read_order,
)

FLEET = ("AGI", "AGII")


def test_an_order_names_a_robot_and_what_is_wrong() -> None:
    body = b'{"robot": "AGI", "mute": true, "false_person": {"x": 1, "y": 2.5}}'

    order = read_order(body)

    assert order == FaultOrder(
        robot="AGI", mute=True, false_person=OrderPlace(x=1.0, y=2.5)
    )


@pytest.mark.parametrize(
    ("order", "field"),
    [
        ({"robot": 1}, "robot"),
        ({"mute": True}, "robot"),
        ({"robot": "AGI", "clock_offset_s": "soon"}, "clock_offset_s"),
        ({"robot": "AGI", "clock_offset_s": 10**400}, "clock_offset_s"),
        ({"robot": "AGI", "clock_offset_s": float("nan")}, "clock_offset_s"),
        ({"robot": "AGI", "freeze_odometry": "gently"}, "freeze_odometry"),
        ({"robot": "AGI", "local_hold": "iveg"}, "local_hold"),
        ({"robot": "AGI", "false_person": 3}, "false_person"),
        ({"robot": "AGI", "hide_people": None, "boom": 1}, "boom"),
        ({"person": -1, "x": 0, "y": 0}, "person"),
        ({"person": 0, "x": 0, "y": 1e7}, "y"),
    ],
)
def test_an_order_that_is_none_is_refused_by_the_name_of_its_field(
    order: dict[str, object], field: str
) -> None:
    with pytest.raises(UnreadableError, match=f"^bad_order: {field}: ") as told:
        read_order(json.dumps(order).encode())

    assert "\n" not in str(told.value)


def test_words_of_a_command_line_are_the_same_orders() -> None:
    words = [
        "AGII:freeze_odometry=true",
        'AGI:false_person={"x": 1, "y": 2}',
        "clock_offset_s=10",
    ]

    assert read_fault_arguments(words, FLEET) == [
        FaultOrder(robot="AGII", freeze_odometry=True),
        FaultOrder(robot="AGI", false_person=OrderPlace(x=1.0, y=2.0)),
        FaultOrder(robot="AGI", clock_offset_s=10.0),
        FaultOrder(robot="AGII", clock_offset_s=10.0),
    ]
