"""Alerts (ISA-18.2)."""

from typing import cast

from pydantic import Field

from iveg.domain.alerts import alert_book, flood
from iveg.domain.alerts.stored import write_alert, write_delivery
from iveg.domain.messages import Channel, MessageDelivery, Priority
from iveg.domain.records import AlertRecord, Json
from iveg.domain.stamps import format_stamp
from iveg.models.base import Listing, Model, Slots, moment, stamp


class Told(Model):
    """A recipient of an alert outside iVeg; ``failed`` is the reason of a failure."""

    channel: Channel
    to: str
    at: str
    failed: str | None

    @classmethod
    def of(cls, one: MessageDelivery) -> "Told":
        """One that is in memory."""
        return cls.of_record(write_delivery(one))

    @classmethod
    def of_record(cls, one: Json) -> "Told":
        """One as an alert's record has it."""
        at = format_stamp(one["at"])
        return cls(
            channel=one["channel"], to=one["to"], at=at, failed=one.get("failed")
        )


class Occurrence(Model):
    """One time that an alert was raised."""

    priority: Priority
    raised_at: str
    cleared_at: str | None
    acknowledged_at: str | None
    acknowledged_by: str | None
    note: str | None
    told: list[Told] = Field(description="Recipients outside iVeg.")

    @classmethod
    def of_record(cls, one: Json) -> "Occurrence":
        """One as an alert's record has it."""
        return cls(
            priority=one["priority"],
            raised_at=format_stamp(one["raised_at"]),
            cleared_at=stamp(one.get("cleared_at")),
            acknowledged_at=stamp(one.get("acknowledged_at")),
            acknowledged_by=one.get("acknowledged_by"),
            note=one.get("note") or None,
            told=[Told.of_record(row) for row in one.get("told", ())],
        )


class Alert(Model):
    """An alert to people: all occurrences of one kind and subject as one."""

    alert_id: str
    priority: Priority
    key: str
    slots: Slots
    robot_id: str | None
    raised_at: str = Field(description="The first time; ``last_raised_at`` the newest.")
    last_raised_at: str
    cleared_at: str | None
    acknowledged_at: str | None
    acknowledged_by: str | None
    note: str | None
    count: int
    told: list[Told] = Field(
        description="Recipients of the newest occurrence outside iVeg."
    )
    members: list[Occurrence] = Field(
        description="The newest occurrences, oldest first."
    )

    @classmethod
    def of(cls, alert: alert_book.BookedAlert) -> "Alert":
        """One alert with its newest occurrences."""
        return cls.of_record(write_alert(alert))

    @classmethod
    def of_record(cls, record: AlertRecord) -> "Alert":
        """One alert as it is remembered."""
        members = [Occurrence.of_record(one) for one in record.members]
        return cls(
            alert_id=record.alert_id,
            priority=cast("Priority", record.priority),
            key=record.key,
            slots=dict(record.slots),
            robot_id=record.robot_id,
            raised_at=format_stamp(record.raised_at),
            last_raised_at=format_stamp(record.last_raised_at),
            cleared_at=stamp(record.cleared_at),
            acknowledged_at=stamp(record.acknowledged_at),
            acknowledged_by=record.acknowledged_by,
            note=record.note,
            count=record.count,
            told=members[-1].told if members else [],
            members=members,
        )


class Flood(Model):
    """Number of alerts within the window; ``since`` null: no flood."""

    count: int
    limit: int
    window_s: float
    since: str | None

    @classmethod
    def of(cls, of: flood.FloodState) -> "Flood":
        """The present rate of alerts."""
        return cls(
            count=of.count,
            limit=flood.FLOOD_LIMIT,
            window_s=flood.FLOOD_WINDOW_S,
            since=moment(of.since),
        )


class AlertListing(Listing[Alert]):
    """One page of alerts, and how fast they come now."""

    flood: Flood


class AcknowledgedAlerts(Model):
    """What became of alerts that somebody acknowledged together."""

    items: list[Alert]
    left: list[str] = Field(
        description="Ids that were left: P1s, seen ones, and what is no longer there."
    )
