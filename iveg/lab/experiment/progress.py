"""Progress of an experiment: in a file for the page, and in lines for a terminal."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Final, Literal, TextIO

from iveg.lab.experiment.plan import PROGRESS, PlannedRun, expected_s, write_json

Phase = Literal["counting", "running"]


State = Literal["running", "done", "broken"]


_WIDTH: Final = 20


_SAID: Final = {"counting": "virtual clock", "running": "real time"}


class Progress:
    """Reports the progress.

    Args:
        directory: Directory of the file.
        steps: Remaining runs, in order; ``before``: number of runs done earlier.
        out: Text output.
    """

    def __init__(
        self, directory: Path, steps: Iterable[PlannedRun], before: int, out: TextIO
    ) -> None:
        self._directory = directory
        self._expected = {step.name: expected_s(step) for step in steps}
        self._done = before
        self._of = before + len(self._expected)
        self._out = out
        self._is_terminal = out.isatty()
        self._now: tuple[str, Phase, float] | None = None
        self._slowness = 1.0
        if not self._is_terminal:
            left = round(self.left_s(0.0))
            print(f"{len(self._expected)} runs to go, about {left} s", file=out)

    def begin(self, step: PlannedRun, phase: Phase, now: float) -> None:
        """A run, or its second half, begins (``now`` monotonic, s)."""
        since = now
        if self._now is not None and self._now[0] == step.name:
            since = self._now[2]
        self._now = (step.name, phase, since)
        if not self._is_terminal:
            print(f"{step.name}: {_SAID[phase]}", file=self._out, flush=True)
        self.tick(now)

    def end(self, step: PlannedRun, now: float) -> None:
        """A run is done; its duration corrects the estimate for the others."""
        expected = self._expected.pop(step.name)
        if self._now is not None:
            took = (now - self._now[2]) / expected
            self._slowness = (self._slowness + took) / 2
        self._done, self._now = self._done + 1, None
        self.tick(now)

    def left_s(self, now: float) -> float:
        """Estimated remaining time (s)."""
        left = self._slowness * sum(self._expected.values())
        return max(0.0, left - (0.0 if self._now is None else now - self._now[2]))

    def tick(self, now: float) -> None:
        """One more second has passed."""
        self._keep("running", "", self.left_s(now))
        if self._is_terminal:
            print(f"\r\x1b[2K{self._line(now)}", end="", file=self._out, flush=True)

    def finish(self, why: str) -> None:
        """The experiment is over; ``why`` is the reason of an early end, or empty."""
        self._keep("broken" if why else "done", why, 0.0)
        if self._is_terminal:
            print("\r\x1b[2K", end="", file=self._out, flush=True)

    def _keep(self, state: State, why: str, left_s: float) -> None:
        name, phase, _ = self._now or (None, None, 0.0)
        progress: dict[str, object] = {
            "state": state,
            "run": name,
            "phase": phase,
            "done": self._done,
            "of": self._of,
            "left_s": round(left_s),
            "why": why,
            "load": round(os.getloadavg()[0], 1),
        }
        write_json(self._directory / PROGRESS, progress)

    def _line(self, now: float) -> str:
        name, phase, _ = self._now or ("", "", 0.0)
        filled = round(_WIDTH * self._done / max(1, self._of))
        bar = "#" * filled + "-" * (_WIDTH - filled)
        minutes, seconds = divmod(round(self.left_s(now)), 60)
        what = f"{name}: {_SAID[phase]}" if phase else ""
        left = f"{minutes}:{seconds:02d} left"
        return f"[{bar}] {self._done:2} of {self._of}  {what:<30} {left}"
