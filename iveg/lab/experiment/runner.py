"""Experiments started from the page: one at a time, each a program of its own.

::

    none ─────start──> running ──program ends──> done | broken
                          │ stop, a live robot, iVeg ends: SIGTERM
                          └ a crash: a partial report with the reason

An experiment has ports, data and robots of its own; it only shares the processor, at
low priority.  None runs while a live robot is connected.
"""

import asyncio
import contextlib
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

from iveg.domain.errors import DataFileError, ExperimentRefusedError
from iveg.domain.stamps import format_stamp
from iveg.lab.experiment.plan import (
    PLANS,
    PROGRESS,
    Size,
    directory_of,
    expected_s,
    write_json,
)
from iveg.lab.experiment.runs_on_disk import (
    UNKNOWN,
    began,
    chosen_of,
    progress_of,
    protected_of,
)
from iveg.models.experiment import Experiment, Experiments

_KEPT: Final = ("IVEG_CONFIDENCE_THRESHOLD", "IVEG_SAFETY_RADIUS_M")
"""Settings of iVeg that an experiment inherits: it follows the same rule."""
_NICENESS: Final = 10
_LOOK_EVERY_S: Final = 0.2
_GRACE_S: Final = 20.0
_OUTPUT_KEPT: Final = 300
"""Characters of a failed program's output that are kept."""


class ExperimentRunner:
    """Starts, supervises and lists experiments.

    Args:
        place: Directory of the experiments.
        is_robot_there: Whether a robot is connected that is not known to be simulated.
        command: Program and arguments before ``experiment run``.
    """

    def __init__(
        self,
        place: Path,
        is_robot_there: Callable[[], bool],
        command: Sequence[str] = (sys.executable, "-m", "iveg"),
    ) -> None:
        self._place = place
        self._is_robot_there = is_robot_there
        self._command = tuple(command)
        self._running: Path | None = None
        self._task: asyncio.Task[None] | None = None
        self._why: str | None = None

    @property
    def refused(self) -> str | None:
        """Reason why none may be started now; None: one may."""
        if self._running is not None:
            return "running"
        return "live_robot" if self._is_robot_there() else None

    def start(self, size: Size) -> Experiment:
        """Start one, or continue the newest of this size that was interrupted.

        Raises:
            ExperimentRefusedError: one is running, or a live robot is connected.
        """
        if self.refused is not None:
            raise ExperimentRefusedError(self.refused)
        directory = directory_of(self._place, PLANS[size])
        directory.mkdir(parents=True, exist_ok=True)
        steps = list(PLANS[size].steps())
        left_s = round(sum(map(expected_s, steps)))
        begun = {"state": "running", "of": len(steps), "left_s": left_s}
        write_json(directory / PROGRESS, {**UNKNOWN, **begun})
        self._running, self._why = directory, None
        self._task = asyncio.create_task(self._run(size, directory), name="experiment")
        return self._experiment(directory)

    def stop(self) -> None:
        """End the running one; it keeps its results so far."""
        self._end("stopped")

    async def close(self) -> None:
        """End the running one because iVeg ends."""
        self._end("interrupted")
        if self._task is not None:
            await asyncio.gather(self._task, return_exceptions=True)

    def list(self) -> Experiments:
        """All experiments, newest first."""
        found = sorted(self._found(), key=lambda one: -one.stat().st_mtime)
        return Experiments(
            items=[self._experiment(one) for one in found], refused=self.refused
        )

    def file(self, name: str, kind: str) -> Path | None:
        """A report (``html``) or a result (``json``); None if absent."""
        for stem in ("result", "partial"):
            file = self._place / name / f"{stem}.{kind}"
            if file.is_file():
                return file
        return None

    # --- the running one ----------------------------------------------------------

    async def _run(self, size: Size, directory: Path) -> None:
        process = await asyncio.create_subprocess_exec(
            *self._command,
            *("experiment", "run", f"--{size}", "--out", str(directory)),
            "--until-eof",
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
            env=_environment(),
            start_new_session=True,
        )
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, process.pid, _NICENESS)
        said = asyncio.create_task(_last_words(process))
        try:
            await self._watch(process)
        finally:
            code = await process.wait()
            await asyncio.to_thread(_close, directory, code, self._why, await said)
            self._running = None

    async def _watch(self, process: asyncio.subprocess.Process) -> None:
        """Wait until it ends or must end."""
        gone = asyncio.create_task(process.wait())
        while not gone.done() and self._why is None:
            if self._is_robot_there():
                self._end("live_robot")
            await asyncio.wait((gone,), timeout=_LOOK_EVERY_S)
        # It may end by itself at the same moment.
        with contextlib.suppress(ProcessLookupError):
            if not gone.done():
                process.terminate()
                await asyncio.wait((gone,), timeout=_GRACE_S)
            if not gone.done():
                process.kill()

    def _end(self, why: str) -> None:
        if self._running is not None and self._why is None:
            self._why = why

    # --- stored ones ----------------------------------------------------------------

    def _found(self) -> Iterator[Path]:
        if self._place.is_dir():
            for size in PLANS:
                yield from self._place.glob(f"{size}-[0-9][0-9][0-9]")

    def _experiment(self, directory: Path) -> Experiment:
        known = {**UNKNOWN, **progress_of(directory)}
        if known["state"] == "running" and directory != self._running:
            # Started by another iVeg, or by one that was killed together with it.
            known |= {"state": "broken", "why": "interrupted"}
        return Experiment(
            name=directory.name,
            size=directory.name.partition("-")[0],
            **known,
            **chosen_of(directory),
            protected=protected_of(self.file(directory.name, "json")),
            began_at=format_stamp(began(directory)),
            report=self.file(directory.name, "html") is not None,
        )


async def _last_words(process: asyncio.subprocess.Process) -> str:
    """The last output of a program, which gives the reason of a failure."""
    assert process.stderr is not None  # noqa: S101 - it was asked for
    last = b""
    async for line in process.stderr:
        last = line.strip() or last
    return last.decode(errors="replace")[:_OUTPUT_KEPT]


def _environment() -> dict[str, str]:
    """The machine's environment without this iVeg's directories and secrets."""
    return {
        name: value
        for name, value in os.environ.items()
        if not name.startswith("IVEG_") or name in _KEPT
    }


def _close(directory: Path, code: int, why: str | None, said: str) -> None:
    """Record how it ended if the program could not."""
    progress = progress_of(directory)
    if progress.get("state") == "running":
        reason = why or f"{said} (exit code {code})".strip()
        _write_partial(directory, reason)
        write_json(directory / PROGRESS, {**progress, "state": "broken", "why": reason})
    elif why is not None and progress.get("state") == "broken":
        write_json(directory / PROGRESS, {**progress, "why": why})


def _write_partial(directory: Path, why: str) -> None:
    # The report writer imports the emulator, so it is imported only when needed.
    from iveg.lab.experiment.run_store import RunStore

    size = directory.name.partition("-")[0]
    with contextlib.suppress(DataFileError):
        RunStore(PLANS[size], directory).finish({}, why)  # type: ignore[index]
