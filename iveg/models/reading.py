"""Stored readings of small sensors of robots."""

from pydantic import JsonValue

from iveg.domain.records import ReadingRecord
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model


class Reading(Model):
    """One reading: the sensor's own fields by name."""

    at: str
    robot_id: str
    kind: str
    value: dict[str, JsonValue]

    @classmethod
    def of_record(cls, record: ReadingRecord) -> "Reading":
        """As it was kept."""
        return cls(
            at=format_stamp(record.at),
            robot_id=record.robot_id,
            kind=record.kind,
            value=dict(record.value or {}),
        )
