"""A person's note, pinned to a time and a place."""

from iveg.domain.records import LogRecord
from iveg.models.base import Model, stamp


class Note(Model):
    """What somebody wrote about a moment; nobody can change it."""

    note_id: int
    at: str | None
    written_at: str | None
    by: str
    text: str
    x: float | None
    y: float | None
    robot_id: str | None
    decision_id: str | None

    @classmethod
    def of_record(cls, line: LogRecord) -> "Note":
        """Of its line in the log."""
        slots = line.slots
        return cls(
            note_id=line.id,
            at=stamp(slots.get("pinned_at", line.at)),
            written_at=stamp(line.at),
            by=slots.get("by", ""),
            text=slots.get("text", ""),
            x=slots.get("x"),
            y=slots.get("y"),
            robot_id=line.robot_id,
            decision_id=line.decision_id,
        )
