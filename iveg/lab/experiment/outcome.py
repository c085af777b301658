"""Results of one run, and of all runs together, as JSON."""

import os
import platform
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from math import ceil
from statistics import fmean
from typing import Any

from iveg import __version__
from iveg.domain.latency.segments import DATA
from iveg.domain.latency.sketch import Sketch
from iveg.domain.records import Json
from iveg.lab.experiment.beliefs import injections
from iveg.lab.experiment.message_times import counts_of
from iveg.lab.experiment.moments import moments_of
from iveg.lab.experiment.observer import ObservedRun
from iveg.lab.experiment.paper_tables import CLASSES
from iveg.lab.experiment.plan import FORMAT, ExperimentPlan, PlannedRun
from iveg.lab.experiment.protection import Protection
from iveg.lab.experiment.protection import whole as all_protection
from iveg.lab.experiment.protection_scoring import protection_of
from iveg.lab.experiment.recording import RunRecording
from iveg.lab.experiment.scoring import Tally, score, tally
from iveg.lab.experiment.slices import HOPS, Slice, whole, with_messages
from iveg.lab.experiment.statistics import thinned

Outcome = dict[str, Any]


def half_of(run: RunRecording) -> Outcome:
    """Result of one half; that of the virtual one is reproducible."""
    pairs = run.pairs
    return {
        "completed": run.completed,
        "failures": run.failures,
        "pictures": len(pairs),
        "classes": {name: asdict(one) for name, one in tally(pairs).items()},
        "slowdowns": slowdowns_of(run.decisions),
        "injection": injections(run.asked),
        "protection": asdict(protection_of(moments_of(run.measured, run.foretold))),
    }


def stack_of(run: ObservedRun) -> Outcome:
    """Result of the run in real time through all programs."""
    within = zip(pairwise(run.edges), run.slices, strict=True)
    return {
        **half_of(run),
        "messages": counts_of(run.times),
        "read": run.read,
        "slices": [
            with_messages(decided, (m for m in run.times if begin <= m.broker < end))
            for (begin, end), decided in within
        ],
        "settled": run.settled,
        "stops": run.stops,
    }


def slowdowns_of(decisions: Sequence[Mapping[str, object]]) -> dict[str, int]:
    """Decisions that slowed a robot: number, applied, observed, out of sight."""
    slowed = [one for one in decisions if one["reason"] in ("person", "robot")]
    return {
        "decided": len(slowed),
        "applied": sum(one["applied_at"] is not None for one in slowed),
        "observed": sum(one["observed_at"] is not None for one in slowed),
        "out_of_sight": sum(one["in_sight"] is False for one in slowed),
    }


def outcome_of(
    step: PlannedRun, counted: Outcome, stack: Outcome | None, load: Sequence[float]
) -> Outcome:
    """One run as stored; ``load`` of the machine before and after its last half."""
    halves = {"counted": counted, "stack": stack}
    return {**asdict(step), **halves, "load": [round(one, 1) for one in load]}


def result_of(
    plan: ExperimentPlan,
    outcomes: Sequence[Outcome],
    chosen: Mapping[str, object],
    why: str = "",
) -> dict[str, object]:
    """The whole experiment; ``why`` is the reason of an early end, or empty."""
    timed = [one for one in outcomes if one["stack"] is not None]
    stack = [one["stack"] for one in timed]
    slices = [piece for one in stack for piece in one["slices"]]
    return {
        "format": FORMAT,
        "plan": asdict(plan),
        "ended_early": why,
        "version": __version__,
        "machine": machine(),
        "configuration": dict(chosen),
        **_summed(plan, [one["counted"] for one in timed]),
        "field": _fields(outcomes),
        "protected": _protected(plan, outcomes),
        "protection": [*_protection(outcomes)],
        "stack": {
            **_summed(plan, stack),
            "read": _sum(one["read"] for one in stack),
            "stops": [stop for one in stack for stop in one["stops"]],
        },
        "latency": {"rows": [*_rows(slices, stack)], "slices": len(slices)},
        "runs": list(outcomes),
    }


def machine() -> dict[str, object]:
    """The machine that it ran on."""
    return {
        "system": platform.platform(),
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
    }


def slices_of(result: Json) -> list[Slice]:
    """All slices of all runs."""
    stacks = (one["stack"] for one in result["runs"])
    return [piece for one in stacks if one is not None for piece in one["slices"]]


def timed_runs(result: Json) -> list[Outcome]:
    """Its runs of the paper's scenarios, which have both halves."""
    return [one for one in result["runs"] if one["stack"] is not None]


def _summed(plan: ExperimentPlan, runs: Sequence[Outcome]) -> dict[str, object]:
    planned = sum(step.is_timed for step in plan.steps())
    done = sum(one["completed"] for one in runs)
    return {
        "completion": {"runs": len(runs), "completed": done, "planned": planned},
        "detection": {name: scored([name], runs) for name in CLASSES},
        "global": scored(CLASSES, runs),
        "slowdowns": _sum(one["slowdowns"] for one in runs),
        "injection": _sum(one["injection"] for one in runs),
    }


def _fields(outcomes: Sequence[Outcome]) -> dict[str, object]:
    """Field tests: completed ones, and why the others were not."""
    runs = [one["counted"] for one in outcomes if one["fails"]]
    return {
        "runs": len(runs),
        "completed": sum(one["completed"] for one in runs),
        "failures": _sum(dict.fromkeys(one["failures"], 1) for one in runs),
    }


def _protected(plan: ExperimentPlan, outcomes: Sequence[Outcome]) -> Json | None:
    """All virtual runs with the experiment's own detector and the rule as it stands."""
    own = {"profile": plan.profile, "rule": "iveg", "fails": False}
    runs = [one["counted"] for one in outcomes if own.items() <= one.items()]
    scored = (Protection.read(one["protection"]) for one in runs)
    return all_protection(scored).row() if runs else None


def _protection(outcomes: Sequence[Outcome]) -> Iterator[dict[str, object]]:
    """Numbers of the scenarios, of their real half, and of each profile and rule."""
    groups: dict[tuple[str, str, str], list[Protection]] = {}
    for one in sorted(outcomes, key=lambda run: run["stack"] is None):
        chosen = one["profile"], one["rule"]
        halves = [("scenarios", one["counted"]), ("real time", one["stack"])]
        if one["stack"] is None:
            halves = [(one["family"], one["counted"])]
        for where, half in halves:
            read = Protection.read(half["protection"])
            groups.setdefault((where, *chosen), []).append(read)
    for (where, profile, rule), runs in groups.items():
        numbers = all_protection(runs).row()
        if where == "real time":
            for entries in numbers["entries"].values():
                entries["foretold"] = None
        yield {"where": where, "profile": profile, "rule": rule, **numbers}


def scored(classes: Sequence[str], runs: Sequence[Outcome]) -> dict[str, object]:
    """Counts, rates with their intervals and AP of some classes over all runs."""
    tallies = [
        Tally(**one["classes"][name])
        for one in runs
        for name in classes
        if name in one["classes"]
    ]
    of = score(tallies)
    sure = [one for each in tallies for one in each.found]
    precision = thinned(of.tp, of.tp + of.fp, of.claims)
    recall = thinned(of.tp, of.tp + of.fn, of.looks)
    return {
        **asdict(of),
        "confidence": fmean(sure) if sure else None,
        "precision": None if precision is None else asdict(precision),
        "recall": None if recall is None else asdict(recall),
        "place": {
            "map": _off([off for each in tallies for off in each.off_map]),
            "robot": _off([off for each in tallies for off in each.off_robot]),
        },
    }


def _off(distances: Sequence[float]) -> dict[str, float] | None:
    """Mean and 95th percentile (nearest rank) of distances (m)."""
    if not distances:
        return None
    rank = ceil(0.95 * len(distances))
    return {"mean_m": fmean(distances), "p95_m": sorted(distances)[rank - 1]}


def _rows(
    slices: Sequence[Slice], stack: Sequence[Outcome]
) -> Iterator[dict[str, object]]:
    found = whole(slices)
    for data in DATA:
        yield {
            "data": data,
            "hops": {hop: _figures(found[data, hop]) for hop in HOPS},
            "messages": _sum(one["messages"].get(data, {}) for one in stack),
        }


def _figures(of: Sketch) -> dict[str, object]:
    def ms(seconds: float | None) -> float | None:
        return None if seconds is None else round(1000.0 * seconds, 2)

    return {
        "count": of.count,
        "mean_ms": ms(of.mean),
        "p50_ms": ms(of.quantile(0.50)),
        "p95_ms": ms(of.quantile(0.95)),
        "p99_ms": ms(of.quantile(0.99)),
    }


def _sum(counts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    total: Counter[str] = Counter()
    for one in counts:
        total.update(one)
    return dict(total)
