"""An experiment's report beside what ``docs/recount.py`` makes of its raw data."""

import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from iveg.lab.experiment import protection_tables, tables
from tests.processes import ROOT


def recounted(directory: Path) -> list[str]:
    """What the script prints, which knows nothing of iVeg."""
    script = ROOT / "docs" / "recount.py"
    done = subprocess.run(
        [sys.executable, "-I", str(script), str(directory)],
        check=True,
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    return done.stdout.splitlines()


def reported(result: Mapping[str, Any]) -> list[str]:
    """The report's rows that are of this experiment."""
    return ["\t".join(map(str, row)) for row in _rows(result)]


def _rows(result: Mapping[str, Any]) -> Iterator[Sequence[object]]:
    own = ("here", "here, real time")
    yield from _named("detection", tables.detection(result), own)
    yield from _named("place", tables.place(result), own)
    for row in tables.claims(result):
        yield "claims", row[1]
    for row in protection_tables.out_of_sight(result):
        yield "sight", *row[1:]
    for row in protection_tables.protection(result):
        yield "protection", *row
    for row in protection_tables.entries(result):
        yield "entries", *row
    yield from _named("latency", tables.latency(result), own)
    for name, rows in (
        ("stops", tables.stops(result)),
        ("runs", tables.runs(result)),
        ("field", tables.field_tests(result)),
    ):
        for row in rows:
            yield name, *row


def _named(
    name: str, rows: Iterator[Sequence[object]], sources: Sequence[str]
) -> Iterator[Sequence[object]]:
    for row in rows:
        if row[1] in sources:
            yield name, *row
