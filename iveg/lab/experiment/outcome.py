"""Results of one run, and of all runs together, as JSON."""

import os
import platform
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from statistics import fmean
from typing import Any

import orjson

from iveg import __version__
from iveg.domain.latency.segments import DATA, SEGMENTS
from iveg.domain.latency.sketch import Sketch
from iveg.lab.experiment.beliefs import injections
from iveg.lab.experiment.observer import ObservedRun, slowdowns_of
from iveg.lab.experiment.paper_tables import CLASSES
from iveg.lab.experiment.plan import Plan, PlannedRun
from iveg.lab.experiment.scoring import Picture, SeenObject, Tally, paired, score, tally
from iveg.lab.experiment.slices import Slice, whole
from iveg.lab.experiment.statistics import thinned
from iveg.lab.experiment.virtual_run import VirtualRunResult

Outcome = dict[str, Any]


def counted_of(run: VirtualRunResult, robot_id: str) -> Outcome:
    """Result of a run on the virtual clock; reproducible."""
    real = [one for one, _ in run.pairs]
    return {
        "completed": run.completed,
        "pictures": len(run.pairs),
        "classes": _tallied(tally(run.pairs)),
        "slowdowns": slowdowns_of([asdict(one) for one in run.decisions]),
        "injection": injections(real, run.beliefs, robot_id),
    }


def stack_of(
    watched: ObservedRun,
    truth: Sequence[Picture],
    decisions: Sequence[Mapping[str, Any]],
    robot_id: str,
) -> Outcome:
    """Result of the run in real time through all programs."""
    pairs = list(paired(truth, watched.pictures))
    return {
        "completed": bool(pairs),
        "pictures": len(pairs),
        "classes": _tallied(tally(pairs)),
        "slowdowns": slowdowns_of(decisions),
        "injection": injections(truth, watched.beliefs, robot_id),
        "order": watched.order,
        "slices": watched.slices,
        "stops": [],
    }


def outcome_of(step: PlannedRun, counted: Outcome, stack: Outcome) -> Outcome:
    """One run as stored."""
    return {**asdict(step), "counted": counted, "stack": stack}


def _tallied(tallies: Mapping[str, Tally]) -> dict[str, Any]:
    return {name: asdict(one) for name, one in tallies.items()}


def result_of(
    plan: Plan,
    outcomes: Sequence[Outcome],
    chosen: Mapping[str, Any],
    why: str = "",
) -> dict[str, Any]:
    """The whole experiment; ``why`` is the reason of an early end, or empty."""
    stack = [one["stack"] for one in outcomes]
    slices = [piece for one in stack for piece in one["slices"]]
    return {
        "format": 2,
        "plan": asdict(plan),
        "ended_early": why,
        "version": __version__,
        "machine": machine(),
        "configuration": dict(chosen),
        **_summed(plan, [one["counted"] for one in outcomes]),
        "stack": {
            **_summed(plan, stack),
            "order": _order(stack),
            "stops": [stop for one in stack for stop in one["stops"]],
        },
        "latency": {"rows": _rows(slices), "slices": len(slices)},
        "runs": list(outcomes),
    }


def machine() -> dict[str, Any]:
    """The machine that it ran on."""
    return {
        "system": platform.platform(),
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
    }


def slices_of(result: Mapping[str, Any]) -> list[Slice]:
    """All slices of all runs."""
    return [piece for one in result["runs"] for piece in one["stack"]["slices"]]


def _summed(plan: Plan, runs: Sequence[Outcome]) -> dict[str, Any]:
    planned = len(list(plan.steps()))
    done = sum(one["completed"] for one in runs)
    return {
        "completion": {"runs": len(runs), "completed": done, "planned": planned},
        "detection": {name: scored([name], runs) for name in CLASSES},
        "global": scored(CLASSES, runs),
        "slowdowns": _sum(one["slowdowns"] for one in runs),
        "injection": _sum(one["injection"] for one in runs),
    }


def scored(classes: Sequence[str], runs: Sequence[Outcome]) -> dict[str, Any]:
    """Counts, rates with their intervals and AP of some classes over all runs."""
    told = [
        Tally(**one["classes"][name])
        for one in runs
        for name in classes
        if name in one["classes"]
    ]
    of = score(told)
    sure = [one for each in told for one in each.found]
    precision = thinned(of.tp, of.tp + of.fp, of.claims)
    recall = thinned(of.tp, of.tp + of.fn, of.looks)
    return {
        **asdict(of),
        "confidence": fmean(sure) if sure else None,
        "precision": None if precision is None else asdict(precision),
        "recall": None if recall is None else asdict(recall),
    }


def _rows(slices: Sequence[Slice]) -> list[dict[str, Any]]:
    found = whole(slices)
    return [
        {"data": data, "hops": {hop: _told(found[data, hop]) for hop in SEGMENTS}}
        for data in DATA
    ]


def _told(of: Sketch) -> dict[str, Any]:
    def ms(seconds: float | None) -> float | None:
        return None if seconds is None else round(1000.0 * seconds, 2)

    return {
        "count": of.count,
        "mean_ms": ms(of.mean),
        "p50_ms": ms(of.quantile(0.50)),
        "p95_ms": ms(of.quantile(0.95)),
        "p99_ms": ms(of.quantile(0.99)),
    }


def _order(runs: Sequence[Outcome]) -> dict[str, dict[str, int]]:
    hops = ("uplink", "fiware")
    return {hop: _sum(one["order"].get(hop, {}) for one in runs) for hop in hops}


def _sum(counts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    total: Counter[str] = Counter()
    for one in counts:
        total.update(one)
    return dict(total)


def read_truth(file: Path) -> list[Picture]:
    """Ground truth of the emulator; an incomplete last line is omitted."""
    pictures = []
    for line in file.read_bytes().splitlines():
        try:
            told = orjson.loads(line)
        except orjson.JSONDecodeError:
            continue
        seen = tuple(
            SeenObject(one["key"], one["class"], one["x"], one["y"])
            for one in told["visible"]
        )
        pictures.append(Picture(told["robot"], told["at"], seen))
    return pictures
