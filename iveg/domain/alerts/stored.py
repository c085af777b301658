"""An alert as the history keeps it, both ways."""

from dataclasses import replace
from typing import cast

from iveg.domain.alerts.alert_book import AlertOccurrence, BookedAlert
from iveg.domain.events import Condition
from iveg.domain.messages import MessageDelivery, Priority
from iveg.domain.observations import Instant
from iveg.domain.records import AlertRecord, Json
from iveg.domain.stamps import wall_of


def write_alert(alert: BookedAlert) -> AlertRecord:
    """An alert as a row; moments are Unix seconds."""
    condition, last = alert.condition, alert.last
    return AlertRecord(
        alert_id=alert.alert_id,
        priority=alert.priority,
        key=condition.key,
        raised_at=alert.raised.wall,
        last_raised_at=last.raised.wall,
        slots=dict(condition.slots),
        robot_id=condition.robot_id,
        cleared_at=wall_of(last.cleared),
        acknowledged_at=wall_of(last.acknowledged),
        acknowledged_by=last.acknowledged_by,
        note=last.note or None,
        count=alert.count,
        members=[_write_occurrence(one) for one in alert.members],
    )


def _write_occurrence(one: AlertOccurrence) -> Json:
    return {
        "priority": one.priority,
        "raised_at": one.raised.wall,
        "cleared_at": wall_of(one.cleared),
        "acknowledged_at": wall_of(one.acknowledged),
        "acknowledged_by": one.acknowledged_by,
        "note": one.note or None,
        "told": [write_delivery(delivery) for delivery in one.deliveries],
    }


def write_delivery(one: MessageDelivery) -> Json:
    """A message to somebody outside iVeg as a JSON object."""
    return {
        "channel": one.channel,
        "to": one.to,
        "at": one.at.wall,
        "failed": one.failed,
    }


def read_alert(record: AlertRecord, now: Instant) -> BookedAlert:
    """An alert of an earlier run as one that is over, with its life as it was."""
    if record.cleared_at is None:
        record = cleared_behind(record, now.wall)
    priority = cast("Priority", record.priority)
    members = tuple(_read_occurrence(one, now) for one in record.members)
    last = AlertOccurrence(
        priority,
        _moment(record.last_raised_at, now),
        _moment(record.cleared_at or now.wall, now),
    )
    return BookedAlert(
        record.alert_id,
        Condition(
            priority,
            record.key,
            _subject(record),
            record.robot_id,
            record.slots,
        ),
        _moment(record.raised_at, now),
        members or (last,),
        unseen=priority if record.acknowledged_at is None else None,
        count=record.count,
    )


def cleared_behind(record: AlertRecord, found: float) -> AlertRecord:
    """An alert that an earlier run left active; what is still wrong is a new one."""
    last = [{**one, "cleared_at": found} for one in record.members[-1:]]
    return replace(record, cleared_at=found, members=[*record.members[:-1], *last])


def _read_occurrence(stored: Json, now: Instant) -> AlertOccurrence:
    cleared, seen = stored.get("cleared_at"), stored.get("acknowledged_at")
    return AlertOccurrence(
        stored["priority"],
        _moment(stored["raised_at"], now),
        None if cleared is None else _moment(cleared, now),
        None if seen is None else _moment(seen, now),
        stored.get("acknowledged_by"),
        stored.get("note") or "",
        tuple(
            MessageDelivery(
                one["channel"], one["to"], _moment(one["at"], now), one.get("failed")
            )
            for one in stored.get("told", ())
        ),
    )


def _subject(record: AlertRecord) -> str:
    """The robot or person concerned; the person is unknown after a restart."""
    if record.robot_id is None or "person" in record.slots:
        return record.alert_id
    return record.robot_id


def _moment(wall: float, now: Instant) -> Instant:
    """A moment of an earlier run on this run's clock."""
    return Instant(now.mono - (now.wall - wall), wall)
