"""Outcome of an order, for readers of the history (docs/interfaces/resources.md).

A row keeps the state of the machine when the order was no longer followed, and that is
the robot's state: "running" does not say how a STOP ended.
"""

from collections.abc import Iterable, Mapping
from typing import Literal

from iveg.domain.records import CommandRecord

Outcome = Literal[
    "open",
    "stood",
    "not_seen_standing",
    "released",
    "resumed",
    "refused",
    "expired",
    "replaced",
    "reached",
    "cancelled",
    "deleted",
]
_OF_GOALS: Mapping[str, Outcome] = {
    "REACHED": "reached",
    "REFUSED": "refused",
    "CANCELLED": "cancelled",
    "DELETED": "deleted",
}
LOUD = frozenset({"UNCONFIRMED", "STILL_MOVING"})


def outcome_of(record: CommandRecord) -> Outcome:
    """Outcome of an order; ``open`` while it is followed."""
    if record.state == "EXPIRED":
        return "expired"
    if record.state == "REPLACED":
        return "replaced"
    if record.kind == "stop":
        return _of_stop(record)
    if record.kind == "goal":
        return _OF_GOALS.get(record.state, "open")
    if record.state == "RELEASING":
        return "open"
    if record.reason is not None:
        return "refused"
    return "released" if record.kind == "release" else "resumed"


def _of_stop(record: CommandRecord) -> Outcome:
    if record.state not in ("RUNNING", "READY"):
        return "open"
    return "not_seen_standing" if record.standing_at is None else "stood"


def was_loud(states: Iterable[str]) -> bool:
    """Whether it was unconfirmed or not obeyed at any time."""
    return not LOUD.isdisjoint(states)
