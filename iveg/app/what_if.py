"""Questions "what if the rule were another": asked over HTTP, answered in a process.

One question of each person at a time, few in line, each hour of a range a piece of work
of its own: so its progress is known, and it can be ended between two pieces.
"""

import asyncio
from collections.abc import Mapping
from typing import Final

from iveg.adapters.history.queries import Queries
from iveg.adapters.worker import Worker
from iveg.domain.errors import HopError, UnknownNameError, WhatIfRefusedError
from iveg.domain.fleet import FleetDescription
from iveg.domain.what_if.crossings import Parameters
from iveg.domain.what_if.inputs import Inputs, sightings_of
from iveg.domain.what_if.judging import Range
from iveg.domain.what_if.outcome import outcomes_of, recorded
from iveg.domain.what_if.questions import Answer, Job, Question
from iveg.pipeline.ports import Clock, Ids

MOST_WAITING: Final = 8
_KEPT: Final = 32
_PART_S: Final = 3600.0
_LEAD_S: Final = 120.0
"""So long before a part begins who was seen and slowed then still counts."""


def judge_part(
    url: str,
    braking: Mapping[str, float],
    since: float,
    until: float,
    tried: tuple[Parameters, ...],
) -> Answer:
    """One piece of a range; in the process."""
    return asyncio.run(_judge_part(url, braking, since, until, tried))


async def _judge_part(
    url: str,
    braking: Mapping[str, float],
    since: float,
    until: float,
    tried: tuple[Parameters, ...],
) -> Answer:
    queries = Queries(url)
    try:
        found = await queries.rule_inputs(braking, since - _LEAD_S, until)
    finally:
        queries.close()
    inputs = Inputs(found.poses, sightings_of(found.seen), braking)
    range_ = Range(inputs, since - _LEAD_S, until)
    return Answer(
        outcomes_of(range_, tried, _LEAD_S),
        recorded(found.decided, since, until),
        sum(int((one.at >= since).sum()) for one in found.poses.values()),
        sum(row[1] >= since for row in found.seen),
    )


class WhatIfs:
    """Takes questions and works them off, one after the other.

    Args:
        url: The history's database.
        fleet: Its live robots are judged.
        worker: The process; tests pass another.
    """

    def __init__(
        self,
        url: str,
        fleet: FleetDescription,
        new_id: Ids,
        clock: Clock,
        worker: Worker | None = None,
    ) -> None:
        self._url = url
        self._braking = {
            name: one.profile.braking
            for name, one in fleet.members.items()
            if one.kind == "live"
        }
        self._new_id, self._clock = new_id, clock
        self._worker = worker or Worker()
        self._jobs: dict[str, Job] = {}
        self._is_asked = asyncio.Event()

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
        if not job.is_over:
            job.state = "cancelled"
        return job

    async def run(self) -> None:
        """Work off questions, until cancelled."""
        while True:
            await self._is_asked.wait()
            self._is_asked.clear()
            while (job := self._next()) is not None:
                await self._work_off(job)

    def close(self) -> None:
        """End the process."""
        self._worker.close()

    def _next(self) -> Job | None:
        waiting = (one for one in self._jobs.values() if one.state == "waiting")
        return next(waiting, None)

    async def _work_off(self, job: Job) -> None:
        job.state = "running"
        try:
            answer = await self._answer(job)
        except HopError as error:
            job.state, job.why = "failed", error.hop
            return
        if job.is_over or answer is None:
            return
        if not answer.poses:
            job.state, job.why = "failed", "no_data"
            return
        job.state, job.answer = "done", answer

    async def _answer(self, job: Job) -> Answer | None:
        """Of the whole range; None: it was cancelled."""
        asked, total = job.asked, None
        parts = _parts(asked.since, asked.until)
        for number, (since, until) in enumerate(parts, 1):
            part = await self._worker.run(
                judge_part, self._url, self._braking, since, until, asked.tried
            )
            if job.is_over:
                return None
            total = part if total is None else total + part
            job.progress = number / len(parts)
        return total


def _parts(since: float, until: float) -> list[tuple[float, float]]:
    """A range in pieces of an hour at most."""
    count = max(1, -int(-(until - since) // _PART_S))
    ends = [min(until, since + _PART_S * (number + 1)) for number in range(count)]
    return list(zip([since, *ends[:-1]], ends, strict=True))
