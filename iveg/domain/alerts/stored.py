"""An occurrence of an alert as the history keeps it, both ways."""

from collections.abc import Callable

from iveg.domain.alerts.alert_book import AlertOccurrence
from iveg.domain.messages import MessageDelivery
from iveg.domain.observations import Instant
from iveg.domain.records import Json

Moment = Callable[[float], Instant]
"""An instant of Unix seconds, on the clock of whoever reads."""


def write_occurrence(one: AlertOccurrence) -> Json:
    """One occurrence as a JSON object; moments are Unix seconds."""
    return {
        "priority": one.priority,
        "raised_at": one.raised.wall,
        "cleared_at": None if one.cleared is None else one.cleared.wall,
        "acknowledged_at": None if one.acknowledged is None else one.acknowledged.wall,
        "acknowledged_by": one.acknowledged_by,
        "note": one.note or None,
        "told": [
            {
                "channel": told.channel,
                "to": told.to,
                "at": told.at.wall,
                "failed": told.failed,
            }
            for told in one.deliveries
        ],
    }


def read_occurrence(stored: Json, moment: Moment) -> AlertOccurrence:
    """The inverse of :func:`write_occurrence`."""
    cleared, seen = stored.get("cleared_at"), stored.get("acknowledged_at")
    return AlertOccurrence(
        stored["priority"],
        moment(stored["raised_at"]),
        None if cleared is None else moment(cleared),
        None if seen is None else moment(seen),
        stored.get("acknowledged_by"),
        stored.get("note") or "",
        tuple(
            MessageDelivery(
                told["channel"], told["to"], moment(told["at"]), told.get("failed")
            )
            for told in stored.get("told", ())
        ),
    )
