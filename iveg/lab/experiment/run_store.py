"""An experiment's directory: one file per run, so that an interrupted one can continue.

::

    plan.json                     whose runs these are
    progress.json                 how far it is
    together-1.json … one for each finished run
    raw/together-1/ … its raw data, where they were asked for
    partial.json, partial.html    it broke off: what there is so far
    result.json, result.html      it is whole

Progress is reported in that file, on a terminal, and elsewhere in plain lines::

    [########------------]  2 of 5  peers-1: real time             1:38 left
"""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path

from iveg.domain.errors import DataFileError
from iveg.lab.experiment.outcome import Outcome, result_of
from iveg.lab.experiment.plan import (
    RAW,
    ExperimentPlan,
    PlannedRun,
    claim,
    read_json,
    write_json,
)
from iveg.lab.experiment.report import write_report


class RunStore:
    """Stored results of one experiment.

    Raises:
        DataFileError: the directory contains another one.
    """

    def __init__(self, plan: ExperimentPlan, directory: Path) -> None:
        self.directory = directory
        self._plan = plan
        claim(directory, plan)

    def steps_left(self) -> list[PlannedRun]:
        """Steps that no earlier start has finished."""
        known = {name for name, _ in self._outcomes()}
        return [step for step in self._plan.steps() if step.name not in known]

    @property
    def done(self) -> int:
        """Number of finished runs."""
        return len(list(self._outcomes()))

    def is_last(self, step: PlannedRun) -> bool:
        """Whether no step follows."""
        return step == [*self._plan.steps()][-1]

    def keep(self, step: PlannedRun, outcome: Outcome) -> None:
        """Store a finished run."""
        write_json(self._file(step), outcome)

    def raw(self, step: PlannedRun) -> Path:
        """Directory of a run's raw data."""
        return self.directory / RAW / step.name

    def finish(self, chosen: Mapping[str, object], why: str) -> Path:
        """Write the result, or the part that exists.

        Args:
            chosen: Settings that influence it.
            why: Reason of an early end, or empty.

        Returns:
            The report.
        """
        for file in self.directory.glob("partial.*"):
            file.unlink()
        name = "partial" if why else "result"
        outcomes = [outcome for _, outcome in self._outcomes()]
        result = result_of(self._plan, outcomes, chosen, why)
        write_json(self.directory / f"{name}.json", result)
        report = self.directory / f"{name}.html"
        report.write_text(write_report(result), encoding="utf-8")
        return report

    def _outcomes(self) -> Iterator[tuple[str, Outcome]]:
        for step in self._plan.steps():
            # A run with an unreadable file counts as not done.
            with contextlib.suppress(DataFileError):
                yield step.name, read_json(self._file(step))

    def _file(self, step: PlannedRun) -> Path:
        return self.directory / f"{step.name}.json"
