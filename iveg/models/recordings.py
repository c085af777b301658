"""Recordings of what came in."""

from pydantic import Field

from iveg.domain.recordings import RecordingFile
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model


class Recording(Model):
    """One file of about an hour."""

    name: str = Field(description="Begins with its first moment (UTC).")
    size: int = Field(description="Bytes.")
    is_open: bool = Field(description="Still written; it cannot be fetched yet.")
    changed_at: str

    @classmethod
    def of(cls, file: RecordingFile) -> "Recording":
        """As it lies on the disk."""
        return cls(
            name=file.name,
            size=file.size,
            is_open=file.is_open,
            changed_at=format_stamp(file.changed),
        )
