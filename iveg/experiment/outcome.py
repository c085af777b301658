"""What one run came to, and all of them together, as JSON that outlives the program."""

import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import orjson

from iveg import __version__
from iveg.domain.errors import DataFileError
from iveg.experiment.paper_tables import CLASSES
from iveg.experiment.plan import Plan, Step
from iveg.experiment.scoring import Picture, Score, Seen, Tally, score
from iveg.experiment.statistics import wilson

Outcome = dict[str, Any]


def outcome_of(
    step: Step,
    tallies: Mapping[str, Tally],
    *,
    pictures: int,
    completed: bool,
    slowdowns: Mapping[str, int],
    injection: Mapping[str, int],
    stops: Sequence[Mapping[str, Any]],
) -> Outcome:
    """One run as it is kept."""
    return {
        **asdict(step),
        "completed": completed,
        "pictures": pictures,
        "classes": {name: asdict(one) for name, one in tallies.items()},
        "slowdowns": dict(slowdowns),
        "injection": dict(injection),
        "stops": list(stops),
    }


def result_of(
    plan: Plan, outcomes: Sequence[Outcome], measured: Mapping[str, Any], why: str = ""
) -> dict[str, Any]:
    """The whole experiment; ``why`` it ended early, empty where it did not."""
    done = sum(one["completed"] for one in outcomes)
    of = len(list(plan.steps()))
    return {
        "format": 1,
        "plan": asdict(plan),
        "ended_early": why,
        "version": __version__,
        "machine": {
            "system": platform.platform(),
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
            "python": platform.python_version(),
        },
        "completion": {"runs": len(outcomes), "completed": done, "planned": of},
        "detection": {name: _scored(outcomes, name) for name in CLASSES},
        "slowdowns": _sum(outcomes, "slowdowns"),
        "injection": _sum(outcomes, "injection"),
        "stops": [stop for one in outcomes for stop in one["stops"]],
        **measured,
        "runs": list(outcomes),
    }


def score_of(outcomes: Sequence[Outcome], class_id: str) -> Score:
    """One class over all runs."""
    told = (one["classes"].get(class_id) for one in outcomes)
    return score(
        Tally(tuple(one["found"]), one["missed"], tuple(one["ghosts"]))
        for one in told
        if one is not None
    )


def _scored(outcomes: Sequence[Outcome], class_id: str) -> dict[str, Any]:
    of = score_of(outcomes, class_id)
    precision, recall = wilson(of.tp, of.tp + of.fp), wilson(of.tp, of.tp + of.fn)
    return {
        "tp": of.tp,
        "fp": of.fp,
        "fn": of.fn,
        "ap": of.ap,
        "precision": None if precision is None else asdict(precision),
        "recall": None if recall is None else asdict(recall),
    }


def _sum(outcomes: Sequence[Outcome], name: str) -> dict[str, int]:
    total: dict[str, int] = {}
    for one in outcomes:
        for key, count in one[name].items():
            total[key] = total.get(key, 0) + count
    return total


def read_truth(file: Path) -> list[Picture]:
    """What the emulator wrote down; a last line that broke off is left out."""
    pictures = []
    for line in file.read_bytes().splitlines():
        try:
            told = orjson.loads(line)
        except orjson.JSONDecodeError:
            continue
        seen = tuple(
            Seen(one["key"], one["class"], one["x"], one["y"])
            for one in told["visible"]
        )
        pictures.append(Picture(told["robot"], told["at"], seen))
    return pictures


def read_json(file: Path) -> Any:
    """A file of ours.

    Raises:
        DataFileError: there is none, or it is no JSON.
    """
    try:
        return orjson.loads(file.read_bytes())
    except (OSError, orjson.JSONDecodeError) as error:
        raise DataFileError(str(file), "", str(error)) from error


def write_json(file: Path, value: object) -> None:
    """Whole or not at all: a crash leaves the file as it was."""
    fresh = file.with_suffix(".part")
    fresh.write_bytes(orjson.dumps(value, option=orjson.OPT_INDENT_2))
    fresh.replace(file)
