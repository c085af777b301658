"""Recorded answers keep their old keys and values (docs/interfaces/README.md)."""

from typing import Any

import orjson
import pytest

from tests.data.answers import RECORDED, answers, differences


async def test_rest_and_live_say_what_they_said_when_recorded() -> None:
    recorded = orjson.loads(RECORDED.read_bytes())

    assert differences(recorded, await answers()) == []


@pytest.mark.parametrize(
    ("new", "told"),
    [
        ({"a": 1, "b": [2]}, []),
        ({"a": 1, "b": [2], "c": 3}, []),
        ({"a": 1}, [".b is gone"]),
        ({"a": 2, "b": [2]}, [".a: 1 became 2"]),
        ({"a": 1, "b": [3]}, [".b[0]: 2 became 3"]),
        ({"a": 1, "b": []}, [".b: [2] became []"]),
    ],
)
def test_a_difference_is_a_lost_key_or_another_value(new: Any, told: list[str]) -> None:
    assert differences({"a": 1, "b": [2]}, new) == told
