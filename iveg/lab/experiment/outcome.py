"""Results of one run and of all runs together, and raw data to recount them.

Raw data has one file for each kind of row, one JSON object a line::

    raw/together-1/run.json           scenario, seed, ends of both halves
    raw/together-1/truth.ndjson …     truth, reported, encounters
    raw/together-1/messages.ndjson    times of each message of the half in real time
    raw/demo-field-paper-1/…          a run for protection: the virtual half alone

docs/experiment.md, "Raw data", has the columns.
"""

import os
import platform
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from statistics import fmean
from typing import Any, Final

import orjson

from iveg import __version__
from iveg.domain.latency import DATA
from iveg.domain.records import Json
from iveg.lab.experiment.messages import HOPS, counts_of, hops_of
from iveg.lab.experiment.plan import ExperimentPlan, PlannedRun, write_json
from iveg.lab.experiment.protection import (
    Protection,
    moments_of,
    p95,
    protection_of,
    total_of,
)
from iveg.lab.experiment.scoring import score, tally
from iveg.lab.experiment.stage import (
    TimedRecording,
    VirtualRecording,
    picture_of_truth,
)

CLASSES: Final = ("farmer", "AGI", "AGII")
Outcome = dict[str, Any]


def counted_of(run: VirtualRecording) -> Outcome:
    """Result of the virtual half, which is reproducible."""
    truth = map(picture_of_truth, run.truth)
    return {
        "pictures": len(run.reported),
        "classes": tally(zip(truth, run.reported, strict=True)),
        "protection": protection_of(moments_of(run.truth, run.encounters)),
    }


def timed_of(run: TimedRecording) -> Outcome:
    """Result of the half in real time through all programs."""
    return {
        "completed": run.completed,
        "messages": counts_of(run.times),
        "hops_ms": hops_of(run.times),
    }


def outcome_of(step: PlannedRun, counted: Outcome, timed: Outcome | None) -> Outcome:
    """One run as stored."""
    return {**asdict(step), "counted": counted, "timed": timed}


def result_of(
    plan: ExperimentPlan,
    outcomes: Sequence[Outcome],
    chosen: Mapping[str, object],
    why: str = "",
) -> dict[str, object]:
    """The whole experiment; ``why`` is the reason of an early end, or empty."""
    runs = [run for run in outcomes if run["timed"] is not None]
    counted, timed = ([run[half] for run in runs] for half in ("counted", "timed"))
    return {
        "plan": asdict(plan),
        "ended_early": why,
        "version": __version__,
        "machine": {
            "system": platform.platform(),
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
            "python": platform.python_version(),
        },
        "configuration": dict(chosen),
        "planned": sum(step.is_timed for step in plan.steps()),
        "completed": sum(half["completed"] for half in timed),
        "detection": {name: _scored([name], counted) for name in CLASSES},
        "global": _scored(CLASSES, counted),
        "protection": [*_protection(outcomes)],
        "latency": [*_rows(timed)],
        "runs": list(outcomes),
    }


def timed_runs(result: Json) -> list[Outcome]:
    """Its runs of the paper's scenarios, which have both halves."""
    return [run for run in result["runs"] if run["timed"] is not None]


def _protection(outcomes: Sequence[Outcome]) -> Iterator[dict[str, object]]:
    """Numbers of the scenarios, then of each profile and rule."""
    groups: dict[tuple[str, str, str], list[Protection]] = {}
    for run in sorted(outcomes, key=lambda run: run["timed"] is None):
        group = run["family"] if run["timed"] is None else "scenarios"
        key = group, run["profile"], run["rule"]
        groups.setdefault(key, []).append(run["counted"]["protection"])
    for (group, profile, rule), runs in groups.items():
        numbers = total_of(runs).row()
        yield {"where": group, "profile": profile, "rule": rule, **numbers}


def _scored(classes: Sequence[str], runs: Sequence[Outcome]) -> dict[str, object]:
    """Score of some classes over all runs."""
    tallies = (run["classes"] for run in runs)
    return asdict(
        score(known[name] for known in tallies for name in classes if name in known)
    )


def _rows(timed: Sequence[Outcome]) -> Iterator[Json]:
    for data in DATA:
        yield {
            "data": data,
            "hops": {
                hop: figures([ms for run in timed for ms in run["hops_ms"][data][hop]])
                for hop in HOPS
            },
            "messages": _sum(run["messages"][data] for run in timed),
        }


def figures(durations_ms: Sequence[float]) -> Json:
    """Number, mean and 95th percentile of durations (ms)."""
    return {
        "count": len(durations_ms),
        "mean_ms": fmean(durations_ms) if durations_ms else None,
        "p95_ms": p95(durations_ms),
    }


def _sum(counts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    total: Counter[str] = Counter()
    for count in counts:
        total.update(count)
    return dict(total)


_LINE: Final = orjson.OPT_APPEND_NEWLINE


def write_raw(
    directory: Path,
    outcome: Outcome,
    virtual: VirtualRecording,
    real: TimedRecording | None,
) -> None:
    """Write the raw data of one run into a directory of its own."""
    directory.mkdir(parents=True)
    _write_rows(directory / "truth.ndjson", virtual.truth)
    _write_rows(directory / "reported.ndjson", virtual.reported)
    _write_rows(directory / "encounters.ndjson", virtual.encounters)
    kept = ("family", "number", "seed", "profile", "rule")
    document: dict[str, object] = {name: outcome[name] for name in kept}
    if real is not None:
        _write_rows(directory / "messages.ndjson", real.times)
        document |= {
            "completed": real.completed,
            "measured": {"began": real.began, "ended": real.ended},
        }
    write_json(directory / "run.json", document)


def _write_rows(file: Path, rows: Iterable[object]) -> None:
    file.write_bytes(b"".join(orjson.dumps(row, option=_LINE) for row in rows))
