"""Issue 13.7: what became of an order, for an audit."""

import pytest

from iveg.domain.stop.commands import outcome_of, was_loud
from tests.fakes.records import command_record


@pytest.mark.parametrize(
    ("kind", "state", "reason", "standing_at", "outcome"),
    [
        ("stop", "SENT", None, None, "open"),
        ("stop", "STANDING", None, 1.0, "open"),
        ("stop", "RUNNING", None, 1.0, "stood"),
        ("stop", "READY", None, 1.0, "stood"),
        ("stop", "RUNNING", None, None, "not_seen_standing"),
        ("stop", "REPLACED", "restarted", 1.0, "replaced"),
        ("release", "RELEASING", None, None, "open"),
        ("release", "READY", None, None, "released"),
        ("release", "STANDING", "challenge", None, "refused"),
        ("release", "EXPIRED", "release_unconfirmed", None, "expired"),
        ("resume", "RUNNING", None, None, "resumed"),
        ("resume", "READY", "held", None, "refused"),
    ],
)
def test_what_became_of_an_order_is_not_what_its_robot_does(
    kind: str, state: str, reason: str | None, standing_at: float | None, outcome: str
) -> None:
    record = command_record(
        kind=kind, state=state, reason=reason, standing_at=standing_at
    )

    assert outcome_of(record) == outcome


def test_a_stop_that_was_not_confirmed_in_time_stays_one() -> None:
    assert was_loud(["REQUESTED", "SENT", "UNCONFIRMED", "DELIVERED", "STANDING"])
    assert not was_loud(["REQUESTED", "SENT", "DELIVERED", "STANDING", "RUNNING"])
