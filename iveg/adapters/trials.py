"""The trial of a rule, in a small file that is replaced as a whole.

One that cannot be read is put aside: then nothing is tried, and nothing else changes.
"""

from pathlib import Path

from pydantic import BaseModel, ConfigDict

from iveg.adapters.files import Form, load_lines, save_lines
from iveg.adapters.rules import StoredRule, rule_fields
from iveg.domain.comparison import Comparison
from iveg.domain.rule.trial import Difference, Trial

FORM = Form("trial")


class FileTrials:
    """The trial; implements ``pipeline.ports.ChoiceStore``."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def load(self) -> Trial | None:
        """The stored one."""
        return next(iter(load_lines(self._path, FORM, _read)), None)

    async def save(self, trial: Trial | None) -> None:
        """Replace the stored one; returns when that is on disk.

        Raises:
            HopError: the disk did not take it.
        """
        lines = [] if trial is None else [_fields(trial)]
        await save_lines(self._path, FORM, lines)


class _StoredTrial(BaseModel):
    """The line of the file."""

    model_config = ConfigDict(strict=True, extra="forbid")

    rule: StoredRule
    by: str
    since: float
    so_far: Comparison | None
    differences: tuple[Difference, ...]


def _read(line: bytes) -> Trial:
    stored = _StoredTrial.model_validate_json(line)
    return Trial(**{**dict(stored), "rule": stored.rule.rule()})


def _fields(trial: Trial) -> dict[str, object]:
    return {
        "rule": rule_fields(trial.rule),
        "by": trial.by,
        "since": trial.since,
        "so_far": trial.so_far,
        "differences": trial.differences,
    }
