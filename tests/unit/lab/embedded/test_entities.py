"""Changes of entities, who is notified of them, and texts that are refused."""

from typing import Any

import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.lab.embedded.entities import (
    Attribute,
    Entity,
    FiwareError,
    check_name,
    holds_forbidden,
    looks_clean,
    read_date,
)

UNPRINTABLE = object()


def touch(robot: Entity, value: Any, instant: str) -> set[str]:
    return robot.apply({"scan": Attribute("array", value, instant)}, 1.0)


def test_a_value_is_not_printed_before_somebody_looks_at_it() -> None:
    robot = Entity("AGI", "Robot", "/")
    touch(robot, UNPRINTABLE, "1")
    assert touch(robot, UNPRINTABLE, "2") == {"scan"}
    with pytest.raises(TypeError):
        _ = robot.attributes["scan"].json


def test_a_change_is_one_of_the_text_or_of_its_time() -> None:
    robot = Entity("AGI", "Robot", "/")
    touch(robot, 1.0, "1")
    assert touch(robot, 1.0, "1") == set()
    assert touch(robot, 1.0, "2") == {"scan"}
    assert touch(robot, 2.0, "2") == {"scan"}


@pytest.mark.parametrize(
    ("given_date", "kept"),
    [
        ("2026-11-22T10:20:30.1235Z", "2026-11-22T10:20:30.124Z"),
        ("2026-11-22T10:20:59.9999+02:00", "2026-11-22T08:21:00.000Z"),
        ("2026-11-22", "2026-11-22T00:00:00.000Z"),
        ("0999-01-01T00:00:00Z", "0999-01-01T00:00:00.000Z"),
    ],
)
def test_a_date_is_kept_in_utc_to_the_millisecond(given_date: str, kept: str) -> None:
    assert read_date(given_date) == kept


NUMBERS = st.floats(-1e15, 1e15, allow_nan=False) | st.integers(-(2**53), 2**53)
TEXTS = st.text(alphabet='a1.0e,]}-+ \\"<é', max_size=12)
VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXTS,
    lambda inner: (
        st.lists(inner, max_size=6) | st.dictionaries(TEXTS, inner, max_size=4)
    ),
    max_leaves=20,
)


@given(VALUES)
def test_what_looks_clean_holds_nothing_forbidden(value: Any) -> None:
    assert not (looks_clean(orjson.dumps(value)) and holds_forbidden(value))


@pytest.mark.parametrize("name", ["", "x" * 257, "a b", "a<", "a/b", "a#b", "a?b"])
def test_a_bad_name_is_refused(name: str) -> None:
    with pytest.raises(FiwareError):
        check_name(name, "entity id")
