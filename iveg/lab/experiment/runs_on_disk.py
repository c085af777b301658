"""What a run on the disk says: its plan, its progress and its result."""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Final

from iveg.domain.errors import DataFileError
from iveg.domain.records import Json
from iveg.lab.experiment.plan import PLAN, PROGRESS, read_json
from iveg.models.experiment import Protected

UNKNOWN: Final[Mapping[str, object]] = {
    "state": "broken",
    "run": None,
    "phase": None,
    "done": 0,
    "of": 0,
    "left_s": 0,
    "why": "",
    "load": None,
}


def began(directory: Path) -> float:
    """Time at which its plan was written (Unix s)."""
    file = directory / PLAN
    return (file if file.exists() else directory).stat().st_mtime


def chosen_of(directory: Path) -> Json:
    """Profile and seed of its plan; nothing before it is written."""
    try:
        plan = read_json(directory / PLAN)["plan"]
    except (DataFileError, KeyError):
        return {}
    return {key: plan.get(key) for key in ("profile", "seed")}


def protected_of(result: Path | None) -> Protected | None:
    """Protection of a result; None: there is none, or of another version."""
    if result is None:
        return None
    try:
        return _read_protected(result, result.stat().st_mtime_ns)
    except (OSError, DataFileError, KeyError):
        return None


@lru_cache(maxsize=64)
def _read_protected(result: Path, _written_ns: int) -> Protected | None:
    """Read once; a page asks every two seconds, and a result has megabytes."""
    numbers = read_json(result)["protected"]
    return None if numbers is None else Protected.of(numbers)


def progress_of(directory: Path) -> Json:
    """How far it has come; nothing before that is written."""
    try:
        progress = read_json(directory / PROGRESS)
    except DataFileError:
        return {}
    return {key: progress[key] for key in UNKNOWN if key in progress}
