"""Raw data of a run, from which everybody can recount the report.

One file for each kind of row, one JSON object a line::

    raw/together-1/run.json           scenario, seed, ends of both halves, STOPs
    raw/together-1/virtual/…          truth, told, encounters, costmap, decisions
    raw/together-1/real/…             the same, and messages and hops
    raw/demo-field-paper-1/…          a run for protection: the virtual half alone

docs/experiment.md, "Raw data", has the columns; ``docs/recount.py`` reads them.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final

import orjson

from iveg.lab.experiment.observer import ObservedRun
from iveg.lab.experiment.outcome import Outcome
from iveg.lab.experiment.plan import write_json
from iveg.lab.experiment.recording import RunRecording

_LINE: Final = orjson.OPT_APPEND_NEWLINE


def write_raw(
    directory: Path,
    outcome: Outcome,
    virtual: RunRecording,
    real: ObservedRun | None,
    configuration: Mapping[str, object],
) -> None:
    """Write the raw data of one run into a directory of its own."""
    _write_half(directory / "virtual", virtual)
    kept = ("family", "number", "seed", "profile", "rule", "fails", "load")
    document: dict[str, object] = {one: outcome[one] for one in kept}
    document["configuration"] = configuration
    document["completed"] = {"virtual": virtual.completed}
    document["failures"] = virtual.failures
    if real is not None:
        _write_half(directory / "real", real)
        _write_rows(directory / "real" / "messages.ndjson", real.times)
        _write_rows(directory / "real" / "hops.ndjson", _decided(real))
        document |= {
            "completed": {"virtual": virtual.completed, "real": real.completed},
            "measured": {"began": real.edges[0], "ended": real.edges[-1]},
            "read": real.read,
            "settled": real.settled,
            "stops": real.stops,
        }
    write_json(directory / "run.json", document)


def _write_half(place: Path, half: RunRecording) -> None:
    place.mkdir(parents=True, exist_ok=True)
    _write_rows(place / "truth.ndjson", half.truth)
    _write_rows(place / "told.ndjson", half.reported)
    _write_rows(place / "encounters.ndjson", half.foretold)
    _write_rows(place / "costmap.ndjson", half.asked)
    _write_rows(place / "decisions.ndjson", half.decisions)


def _write_rows(file: Path, rows: Iterable[object]) -> None:
    file.write_bytes(b"".join(orjson.dumps(row, option=_LINE) for row in rows))


def _decided(real: ObservedRun) -> Iterator[dict[str, object]]:
    """Δt₃ as iVeg told it: bins of each slice and kind of data."""
    for number, piece in enumerate(real.slices):
        for data, hops in piece.items():
            for hop, bins in hops.items():
                yield {"slice": number, "data": data, "hop": hop, **bins}
