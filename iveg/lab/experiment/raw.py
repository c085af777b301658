"""Raw data of a run, from which everybody can recount the report.

One file for each kind of row, one JSON object a line::

    raw/together-1/run.json           scenario, seed, ends of both halves, STOPs
    raw/together-1/virtual/…          truth, told, costmap, decisions
    raw/together-1/real/…             the same, and messages and hops

docs/experiment.md, "Raw data", has the columns; ``docs/recount.py`` reads them.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final

import orjson

from iveg.lab.experiment.observer import ObservedRun
from iveg.lab.experiment.outcome import Outcome
from iveg.lab.experiment.plan import write_json
from iveg.lab.experiment.recording import Recording

_LINE: Final = orjson.OPT_APPEND_NEWLINE


def write_raw(
    directory: Path,
    outcome: Outcome,
    virtual: Recording,
    real: ObservedRun,
    configuration: Mapping[str, object],
) -> None:
    """Write the raw data of one run into a directory of its own."""
    for half, name in ((virtual, "virtual"), (real, "real")):
        place = directory / name
        place.mkdir(parents=True, exist_ok=True)
        _write_rows(place / "truth.ndjson", half.truth)
        _write_rows(place / "told.ndjson", half.told)
        _write_rows(place / "costmap.ndjson", half.asked)
        _write_rows(place / "decisions.ndjson", half.decisions)
    _write_rows(directory / "real" / "messages.ndjson", real.times)
    _write_rows(directory / "real" / "hops.ndjson", _decided(real))
    kept = ("family", "number", "seed", "load")
    told = {
        "completed": {"virtual": virtual.completed, "real": real.completed},
        "configuration": configuration,
        "read": real.read,
        "settled": real.settled,
        "stops": real.stops,
    }
    write_json(directory / "run.json", {**{k: outcome[k] for k in kept}, **told})


def _write_rows(file: Path, rows: Iterable[object]) -> None:
    file.write_bytes(b"".join(orjson.dumps(row, option=_LINE) for row in rows))


def _decided(real: ObservedRun) -> Iterator[dict[str, object]]:
    """Δt₃ as iVeg told it: bins of each slice and kind of data."""
    for number, piece in enumerate(real.slices):
        for data, hops in piece.items():
            for hop, bins in hops.items():
                yield {"slice": number, "data": data, "hop": hop, **bins}
