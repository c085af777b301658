"""What a change did to an entity, and which subscriptions may be told of it."""

from typing import Any

import pytest

from iveg.lab.embedded.entities import Entity, EntityChange, Touched, apply
from iveg.lab.embedded.errors import FiwareError
from iveg.lab.embedded.orion_dates import date_text
from iveg.lab.embedded.subscriptions import Subscription, read_subscription

UNPRINTABLE = object()
EARLIER, LATER = {"TimeInstant": b"1"}, {"TimeInstant": b"2"}


def entity() -> Entity:
    return Entity("AGI", "Robot", "/", 0.0, 0.0)


def touch(one: Entity, value: Any, metadata: dict[str, bytes]) -> Touched:
    return apply(one, {"scan": EntityChange("array", value, metadata)}, 1.0)


def subscription(**condition: Any) -> Subscription:
    document = {
        "subject": {"entities": [{"id": "AGI"}], "condition": condition},
        "notification": {"http": {"url": "http://127.0.0.1:9"}},
    }
    return read_subscription(document, "", "/")


def test_a_value_is_not_printed_before_somebody_looks_at_it() -> None:
    robot = entity()
    touch(robot, UNPRINTABLE, EARLIER)
    assert touch(robot, UNPRINTABLE, LATER).has_changed("scan")
    with pytest.raises(TypeError):
        _ = robot.attributes["scan"].json


@pytest.mark.parametrize(
    ("value", "metadata", "metadata_too", "changed"),
    [
        (1.0, EARLIER, True, False),
        (1.0, LATER, True, True),
        (1.0, LATER, False, False),
        (2.0, EARLIER, False, True),
        (1.0 + 1e-11, EARLIER, True, False),
    ],
)
def test_a_change_is_one_of_the_text_or_if_wanted_of_metadata(
    value: float, metadata: dict[str, bytes], metadata_too: bool, changed: bool
) -> None:
    robot = entity()
    touch(robot, 1.0, EARLIER)
    touched = touch(robot, value, metadata)
    assert touched.has_changed("scan", metadata_too=metadata_too) == changed
    assert not touched.has_changed("pose")


@pytest.mark.parametrize(
    ("condition", "may"),
    [
        ({}, True),
        ({"attrs": ["scan", "pose"]}, True),
        ({"attrs": ["pose"]}, False),
        ({"attrs": ["pose"], "alterationTypes": ["entityUpdate"]}, True),
    ],
)
def test_who_watches_other_attributes_is_passed_over(
    condition: dict[str, Any], may: bool
) -> None:
    assert subscription(**condition).may_want(("scan",)) == may


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


@pytest.mark.parametrize("operator", ["$min", "$push", "$pull"])
def test_an_operator_that_is_not_supported_changes_nothing(operator: str) -> None:
    robot = entity()

    with pytest.raises(FiwareError, match="501"):
        apply(robot, {"n": EntityChange("Number", {operator: 1}, {})}, 1.0)

    assert robot.attributes == {}
