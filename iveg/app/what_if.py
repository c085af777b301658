"""Questions "what if the rule were another": asked over HTTP, answered in a process.

One question of each person at a time, few in line, each hour of a range a piece of work
of its own: so first curves come early, and long ranges use two processes.
"""

import asyncio
import os
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from iveg.adapters import clock
from iveg.adapters.history.asking import ask_once
from iveg.adapters.history.rule_inputs import rule_inputs
from iveg.adapters.ids import new_id
from iveg.adapters.truth_files import read_nearest
from iveg.adapters.worker import Worker
from iveg.domain.errors import (
    DataFileError,
    HopError,
    UnknownNameError,
    WhatIfRefusedError,
)
from iveg.domain.fleet import FleetDescription
from iveg.domain.what_if.inputs import Inputs, sightings_of
from iveg.domain.what_if.judging import Range
from iveg.domain.what_if.outcome import outcomes_of, recorded
from iveg.domain.what_if.parameters import Parameters
from iveg.domain.what_if.questions import Answer, Job, Question
from iveg.domain.what_if.truth import Nearest
from iveg.pipeline.ports import Clock, Ids
from iveg.settings import Settings

MOST_WAITING: Final = 8
_KEPT: Final = 32
_PART_S: Final = 3600.0
_PROCESSES: Final = min(2, os.cpu_count() or 1)
_LEAD_S: Final = 120.0
"""So long before a part begins who was seen and slowed then still counts."""


def judge_part(
    url: str,
    braking: Mapping[str, float],
    since: float,
    until: float,
    tried: tuple[Parameters, ...],
    truth: Path | None = None,
) -> Answer:
    """One piece of a range; in the process.

    Raises:
        HopError: the database does not answer, or the file of the truth.
    """
    found = ask_once(url, rule_inputs, braking, since - _LEAD_S, until)
    inputs = Inputs(found.poses, sightings_of(found.seen), braking)
    nearest = {} if truth is None else _truth(truth, since, until)
    range_ = Range(inputs, since - _LEAD_S, until, nearest)
    return Answer(
        outcomes_of(range_, tried, _LEAD_S),
        recorded(found.decided, since, until),
        sum(int((one.at >= since).sum()) for one in found.poses.values()),
        sum(row[1] >= since for row in found.seen),
    )


def _truth(file: Path, since: float, until: float) -> Mapping[str, Nearest]:
    try:
        return read_nearest(file, since, until)
    except DataFileError as error:
        raise HopError("truth", str(error)) from error


class WhatIfs:
    """Takes questions and works them off, one after the other.

    Args:
        url: The history's database.
        fleet: Its live robots are judged.
        truth: File of ``iveg emulator --truth``; None: nobody knows.
        workers: Processes, all of low priority; more than one work at a long range.
    """

    def __init__(
        self,
        url: str,
        fleet: FleetDescription,
        ids: Ids,
        read_clock: Clock,
        truth: Path | None = None,
        workers: Sequence[Worker] | None = None,
    ) -> None:
        self._url, self._truth = url, truth
        self._braking = {
            name: one.profile.braking
            for name, one in fleet.members.items()
            if one.kind == "live"
        }
        self._new_id, self._clock = ids, read_clock
        self._workers = workers or [Worker() for _ in range(_PROCESSES)]
        self._jobs: dict[str, Job] = {}
        self._is_asked = asyncio.Event()

    @classmethod
    def of(cls, settings: Settings, url: str, fleet: FleetDescription) -> "WhatIfs":
        """The server's."""
        truth = Path(settings.truth) if settings.truth else None
        return cls(url, fleet, new_id, clock.now, truth)

    def ask(self, question: Question, by: str) -> Job:
        """Take a question.

        Raises:
            WhatIfRefusedError: one of this person is not over, or the line is full.
        """
        going = [one for one in self._jobs.values() if not one.is_over]
        if any(one.by == by for one in going):
            raise WhatIfRefusedError("yours")
        if len(going) >= MOST_WAITING:
            raise WhatIfRefusedError("full")
        job = Job(self._new_id(), by, question, self._clock())
        self._jobs[job.job_id] = job
        for old in [one for one in self._jobs.values() if one.is_over][:-_KEPT]:
            del self._jobs[old.job_id]
        self._is_asked.set()
        return job

    def find(self, job_id: str) -> Job:
        """A question by its id.  Raises UnknownNameError."""
        job = self._jobs.get(job_id)
        if job is None:
            raise UnknownNameError("question", job_id)
        return job

    def newest(self) -> list[Job]:
        """Every question that is known, newest first."""
        return list(reversed(self._jobs.values()))

    def cancel(self, job_id: str, by: str | None) -> Job:
        """End a question that waits or is worked on; one that is over stays as it is.

        Args:
            job_id: Of the question.
            by: Who ends it: only their own; None: anybody's.

        Raises:
            UnknownNameError: there is none, or it is another's.
        """
        job = self.find(job_id)
        if by not in (None, job.by):
            raise UnknownNameError("question", job_id)
        if job.state == "running":
            self._end_processes()
        if not job.is_over:
            job.state, job.answer = "cancelled", None
        return job

    async def run(self) -> None:
        """Work off questions, until cancelled."""
        while True:
            await self._is_asked.wait()
            self._is_asked.clear()
            while (job := self._next()) is not None:
                await self._work_off(job)

    def close(self) -> None:
        """End the processes."""
        for worker in self._workers:
            worker.close()

    def _end_processes(self) -> None:
        for worker in self._workers:
            worker.interrupt()

    def _next(self) -> Job | None:
        waiting = (one for one in self._jobs.values() if one.state == "waiting")
        return next(waiting, None)

    async def _work_off(self, job: Job) -> None:
        job.state = "running"
        parts = _parts(job.asked.since, job.asked.until)
        share, left = 1.0 / len(parts), deque(parts)
        workers = self._workers[: len(parts)]
        lines = [
            asyncio.create_task(self._judge(job, worker, left, share))
            for worker in workers
        ]
        try:
            await asyncio.gather(*lines)
        except HopError as error:
            if not job.is_over:
                job.state, job.why, job.answer = "failed", error.hop, None
                self._end_processes()
        finally:
            for line in lines:
                line.cancel()
            await asyncio.gather(*lines, return_exceptions=True)
        if job.is_over:
            return
        job.progress = 1.0
        if job.answer is None or not job.answer.poses:
            job.state, job.why, job.answer = "failed", "no_data", None
            return
        job.state = "done"
        # One process stays for the next question, the memory of others is let go.
        for spare in workers[1:]:
            spare.interrupt()

    async def _judge(
        self, job: Job, worker: Worker, left: deque[tuple[float, float]], share: float
    ) -> None:
        """Judge one piece after the other until none is left.  Raises HopError."""
        while left:
            piece = await worker.run(
                judge_part,
                self._url,
                self._braking,
                *left.popleft(),
                job.asked.tried,
                self._truth,
            )
            if job.is_over:
                return
            job.answer = piece if job.answer is None else job.answer + piece
            job.progress += share


def _parts(since: float, until: float) -> list[tuple[float, float]]:
    """A range in pieces of an hour at most."""
    count = max(1, -int(-(until - since) // _PART_S))
    ends = [min(until, since + _PART_S * (number + 1)) for number in range(count)]
    return list(zip([since, *ends[:-1]], ends, strict=True))
