"""A line of the log."""

from pydantic import Field

from iveg.domain.records import LogRecord
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, Slots


class LogEntry(Model):
    """One line of the action and inference log."""

    id: int
    at: str
    kind: str
    robot_id: str | None
    key: str
    slots: Slots
    class_: str | None = Field(validation_alias="class", serialization_alias="class")
    decision_id: str | None

    @classmethod
    def of_record(cls, record: LogRecord) -> "LogEntry":
        """One line, live and remembered."""
        return cls(
            id=record.id,
            at=format_stamp(record.at),
            kind=record.kind,
            robot_id=record.robot_id,
            key=record.key,
            slots=dict(record.slots),
            class_=record.class_,
            decision_id=record.decision_id,
        )
