import json

import pytest

from iveg.domain.errors import DataFileError, UnreadableError
from iveg.lab.emulator.orders import (
    FaultOrder,
    OrderPlace,
    PersonOrder,
    read_fault_arguments,
    read_order,
)

FLEET = ("AGI", "AGII")


def test_an_order_names_a_robot_and_what_is_wrong() -> None:
    body = b'{"robot": "AGI", "drop_percent": 10, "false_person": {"x": 1, "y": 2.5}}'

    order = read_order(body)

    assert order == FaultOrder(
        robot="AGI", drop_percent=10.0, false_person=OrderPlace(x=1.0, y=2.5)
    )


def test_an_order_may_place_a_person_instead() -> None:
    assert read_order(b'{"person": 1, "x": 2.0, "y": 3}') == PersonOrder(
        person=1, x=2.0, y=3.0
    )


@pytest.mark.parametrize(
    ("order", "field"),
    [
        ({"robot": 1}, "robot"),
        ({"mute": True}, "robot"),
        ({"robot": "AGI", "clock_offset_s": "soon"}, "clock_offset_s"),
        ({"robot": "AGI", "clock_offset_s": 10**400}, "clock_offset_s"),
        ({"robot": "AGI", "clock_offset_s": float("nan")}, "clock_offset_s"),
        ({"robot": "AGI", "drop_percent": -1}, "drop_percent"),
        ({"robot": "AGI", "duplicate_percent": True}, "duplicate_percent"),
        ({"robot": "AGI", "reorder_percent": 100.1}, "reorder_percent"),
        ({"robot": "AGI", "delay_ms": 10_001}, "delay_ms"),
        ({"robot": "AGI", "jitter_ms": [1]}, "jitter_ms"),
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


@pytest.mark.parametrize("body", [b"", b"{", b"\xff", b"[" * 100_000])
def test_bytes_that_are_no_json_are_refused(body: bytes) -> None:
    with pytest.raises(UnreadableError, match="not_json"):
        read_order(body)


def test_words_of_a_command_line_are_the_same_orders() -> None:
    words = [
        "AGII:freeze_odometry=repeat",
        'AGI:false_person={"x": 1, "y": 2}',
        "drop_percent=10",
    ]

    assert read_fault_arguments(words, FLEET) == [
        FaultOrder(robot="AGII", freeze_odometry="repeat"),
        FaultOrder(robot="AGI", false_person=OrderPlace(x=1.0, y=2.0)),
        FaultOrder(robot="AGI", drop_percent=10.0),
        FaultOrder(robot="AGII", drop_percent=10.0),
    ]


@pytest.mark.parametrize(
    ("word", "why"),
    [
        ("drop_percent", "must be field=value or robot:field=value"),
        ("AGI:=1", "must be field=value or robot:field=value"),
        ("robot=AGI", "must be field=value or robot:field=value"),
        ("AGV:mute=true", "there is no robot AGV among AGI, AGII"),
        ("drop=10", "drop: Extra inputs are not permitted"),
        ("mute=maybe", "mute: Input should be a valid boolean"),
    ],
)
def test_a_word_that_is_no_order_is_refused_with_one_sentence(
    word: str, why: str
) -> None:
    with pytest.raises(DataFileError, match=f"^--fault, {word}: {why}"):
        read_fault_arguments([word], FLEET)
