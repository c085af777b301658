"""Where experiments lie, and how their files are read and written."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import orjson

from iveg import __version__
from iveg.domain.errors import DataFileError
from iveg.experiment.plan import Plan

PROGRESS: Final = "progress.json"
_PLAN: Final = "plan.json"


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
    fresh.write_bytes(orjson.dumps(value))
    fresh.replace(file)


def directory_of(place: Path, plan: Plan) -> Path:
    """The newest experiment of this size, if it is this plan's and broke off, or a new.

    What another version or another plan began is not mixed with this one.
    """
    known = sorted(place.glob(f"{plan.size}-*")) if place.is_dir() else []
    if known and not (known[-1] / "result.json").exists() and is_of(known[-1], plan):
        return known[-1]
    return place / f"{plan.size}-{len(known) + 1:03d}"


def is_of(directory: Path, plan: Plan) -> bool:
    """Whether a directory is empty, or holds runs of this very plan and version."""
    try:
        return bool(read_json(directory / _PLAN) == _written(plan))
    except DataFileError:
        return not list(directory.glob("*-*.json"))


def claim(directory: Path, plan: Plan) -> None:
    """Make a directory this plan's.

    Raises:
        DataFileError: it holds runs of another plan, or of another version.
    """
    directory.mkdir(parents=True, exist_ok=True)
    if not is_of(directory, plan):
        reason = "holds runs of another plan or version; name another directory"
        raise DataFileError(str(directory), "", reason)
    write_json(directory / _PLAN, _written(plan))


def _written(plan: Plan) -> Any:
    return orjson.loads(orjson.dumps({"version": __version__, "plan": asdict(plan)}))
