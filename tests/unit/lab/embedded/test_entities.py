"""What a change did to an entity, who may be told of it, which texts are refused."""

from typing import Any

import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.lab.embedded.entities import (
    Entity,
    EntityChange,
    FiwareError,
    Touched,
    apply,
    check_name,
    date_text,
    holds_forbidden,
    looks_clean,
)
from iveg.lab.embedded.subscriptions import Subscription, read_subscription

UNPRINTABLE = object()


def entity() -> Entity:
    return Entity("AGI", "Robot", "/", 0.0, 0.0)


def touch(one: Entity, value: Any, instant: bytes) -> Touched:
    return apply(one, {"scan": EntityChange("array", value, instant)}, 1.0)


def subscription(**condition: Any) -> Subscription:
    document = {
        "subject": {"entities": [{"id": "AGI"}], "condition": condition},
        "notification": {"http": {"url": "http://127.0.0.1:9"}},
    }
    return read_subscription(document, "", "/")


def test_a_value_is_not_printed_before_somebody_looks_at_it() -> None:
    robot = entity()
    touch(robot, UNPRINTABLE, b"1")
    assert touch(robot, UNPRINTABLE, b"2").has_changed("scan")
    with pytest.raises(TypeError):
        _ = robot.attributes["scan"].value.json


@pytest.mark.parametrize(
    ("value", "instant", "changed"),
    [(1.0, b"1", False), (1.0, b"2", True), (2.0, b"1", True)],
)
def test_a_change_is_one_of_the_text_or_of_its_time(
    value: float, instant: bytes, changed: bool
) -> None:
    robot = entity()
    touch(robot, 1.0, b"1")
    touched = touch(robot, value, instant)
    assert touched.has_changed("scan") == changed
    assert not touched.has_changed("pose")


def test_a_change_without_a_time_keeps_the_present_one() -> None:
    robot = entity()
    touch(robot, 1.0, b"1")
    apply(robot, {"scan": EntityChange(None, 2.0)}, 2.0)
    kept = robot.attributes["scan"]
    assert (kept.type, kept.value.json, kept.instant) == ("array", b"2.0", b"1")


@pytest.mark.parametrize(
    ("attrs", "may"), [([], True), (["scan", "pose"], True), (["pose"], False)]
)
def test_who_watches_other_attributes_is_passed_over(
    attrs: list[str], may: bool
) -> None:
    assert subscription(attrs=attrs).may_want(("scan",)) == may


@pytest.mark.parametrize(
    ("told", "kept"),
    [
        ("2026-11-22T10:20:30.1235Z", b'"2026-11-22T10:20:30.124Z"'),
        ("2026-11-22T10:20:59.9999+02:00", b'"2026-11-22T08:21:00.000Z"'),
        ("2026-11-22", b'"2026-11-22T00:00:00.000Z"'),
        ("0999-01-01T00:00:00Z", b'"0999-01-01T00:00:00.000Z"'),
    ],
)
def test_a_date_is_kept_in_utc_to_the_millisecond(told: str, kept: bytes) -> None:
    assert date_text(told) == kept


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


@pytest.mark.parametrize("character", list("<>\"'=;()"))
def test_each_forbidden_character_is_found_in_values_and_not_in_keys(
    character: str,
) -> None:
    value = {"k": [f"a{character}"]}
    assert holds_forbidden(value)
    assert not looks_clean(orjson.dumps(value))
    assert not holds_forbidden({f"k{character}": 1})


def test_an_escaped_forbidden_character_does_not_look_clean() -> None:
    assert not looks_clean(b'{"a": "\\u003cb"}')


@pytest.mark.parametrize("name", ["", "x" * 257, "a b", "a<", "a/b", "a#b", "a?b"])
def test_a_bad_name_is_refused(name: str) -> None:
    with pytest.raises(FiwareError):
        check_name(name, "entity id")
