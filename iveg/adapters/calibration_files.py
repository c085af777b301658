"""Calibration files: TOML in, rows by detector and class out (docs/safety.md)."""

from typing import Annotated, Literal

from pydantic import Field

from iveg.adapters.toml_files import Table, complaint, read_table, read_text
from iveg.domain.parameters import Class
from iveg.domain.tracking.looks import ANY, Calibration, Calibrations

PAPER = "paper"
"""Name of the file with the counts of the paper's field test."""
_Boxes = Annotated[int, Field(ge=0, le=10_000_000)]


def load_calibrations(name_or_file: str) -> Calibrations:
    """The rows of a file, or of ``paper``; none of an empty name.

    Raises:
        DataFileError: the file cannot be used; it says file and key.
    """
    if not name_or_file:
        return Calibrations()
    text = read_text(name_or_file, {PAPER: "calibration.toml"})
    return read_calibrations(text, name_or_file)


def read_calibrations(text: str, file: str) -> Calibrations:
    """Read rows from TOML; ``file`` is its name in complaints.

    Raises:
        DataFileError: naming file, key and reason.
    """
    rows: dict[tuple[str, Class], Calibration] = {}
    for index, row in enumerate(read_table(text, file, _FileTable).calibrations):
        if not row.right + row.wrong:
            reason = "counts no box, with the row's `wrong`"
            raise complaint(file, ("calibrations", index, "right"), reason)
        key = row.detector or ANY, row.class_
        if key in rows:
            reason = "is of a detector and class that have a row already"
            raise complaint(file, ("calibrations", index, "class"), reason)
        rows[key] = Calibration.of_counts(row.right, row.wrong, row.mean_confidence)
    return Calibrations(rows)


class _Row(Table):
    class_: Annotated[Literal["person"], Field(alias="class")]
    detector: Annotated[str, Field(min_length=1, max_length=64)] | None = None
    right: _Boxes
    wrong: _Boxes
    mean_confidence: Annotated[float, Field(gt=0.0, lt=1.0)]


class _FileTable(Table):
    calibrations: Annotated[list[_Row], Field(min_length=1, max_length=64)]
