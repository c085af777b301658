import json

import pytest

from iveg.domain.errors import UnreadableError
from iveg.lab.emulator.orders import FaultOrder, OrderPlace, read_order


def test_an_order_names_a_robot_and_what_is_wrong() -> None:
    body = b'{"robot": "AGI", "mute": true, "thing": {"x": 1, "y": 2.5}}'

    assert read_order(body) == FaultOrder(
        robot="AGI", mute=True, thing=OrderPlace(x=1.0, y=2.5)
    )


@pytest.mark.parametrize(
    ("order", "field"),
    [
        ({"robot": 1}, "robot"),
        ({"mute": True}, "robot"),
        ({"robot": "AGI", "clock_offset_s": "soon"}, "clock_offset_s"),
        ({"robot": "AGI", "clock_offset_s": 10**400}, "clock_offset_s"),
        ({"robot": "AGI", "local_hold": "iveg"}, "local_hold"),
        ({"robot": "AGI", "thing": 3}, "thing"),
        ({"robot": "AGI", "thing": {"x": 0, "y": 1e7}}, "thing.y"),
        ({"robot": "AGI", "hide_people": None, "boom": 1}, "boom"),
    ],
)
def test_an_order_that_is_none_is_refused_by_the_name_of_its_field(
    order: dict[str, object], field: str
) -> None:
    with pytest.raises(UnreadableError, match=f"^bad_order: {field}: ") as refused:
        read_order(json.dumps(order).encode())

    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("body", [b"", b"nonsense", b"[1]", b'{"robot": "AGI'])
def test_a_body_that_is_no_json_object_is_refused(body: bytes) -> None:
    with pytest.raises(UnreadableError, match=r"^bad_order: "):
        read_order(body)
