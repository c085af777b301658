"""Directories of experiments, and reading and writing of their files."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import orjson

from iveg import __version__
from iveg.domain.errors import DataFileError
from iveg.lab.experiment.plan import Plan

PROGRESS: Final = "progress.json"
_PLAN: Final = "plan.json"


def read_json(file: Path) -> Any:
    """Read one of our JSON files.

    Raises:
        DataFileError: the file is missing or is not JSON.
    """
    try:
        return orjson.loads(file.read_bytes())
    except (OSError, orjson.JSONDecodeError) as error:
        raise DataFileError(str(file), "", str(error)) from error


def write_json(file: Path, value: object) -> None:
    """Write atomically: after a crash the file is the old one or the new one."""
    fresh = file.with_suffix(".part")
    fresh.write_bytes(orjson.dumps(value))
    fresh.replace(file)


def directory_of(place: Path, plan: Plan) -> Path:
    """Directory of an experiment: the newest one of this plan if incomplete, or a new.

    Results of another version or another plan are not mixed with this one.
    """
    known = sorted(place.glob(f"{plan.size}-*")) if place.is_dir() else []
    if (
        known
        and not (known[-1] / "result.json").exists()
        and belongs_to(known[-1], plan)
    ):
        return known[-1]
    return place / f"{plan.size}-{len(known) + 1:03d}"


def belongs_to(directory: Path, plan: Plan) -> bool:
    """Whether a directory is empty, or contains runs of this very plan and version."""
    try:
        return bool(read_json(directory / _PLAN) == _written(plan))
    except DataFileError:
        return not list(directory.glob("*-*.json"))


def claim(directory: Path, plan: Plan) -> None:
    """Assign a directory to this plan.

    Raises:
        DataFileError: it contains runs of another plan, or of another version.
    """
    directory.mkdir(parents=True, exist_ok=True)
    if not belongs_to(directory, plan):
        reason = "holds runs of another plan or version; name another directory"
        raise DataFileError(str(directory), "", reason)
    write_json(directory / _PLAN, _written(plan))


def _written(plan: Plan) -> Any:
    return orjson.loads(orjson.dumps({"version": __version__, "plan": asdict(plan)}))
