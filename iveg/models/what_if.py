"""What another rule would have done over a range that is past."""

from typing import Literal

from pydantic import Field

from iveg.domain.stamps import format_stamp
from iveg.domain.what_if import outcome, parameters
from iveg.domain.what_if.questions import Job
from iveg.models.base import Model, rounded


class TriedParameters(Model):
    """Parameters of the rule, those that people cannot change among them."""

    confidence_threshold: float
    radius_m: float
    release_beyond_m: float = Field(description="So far outside a robot is let go (m).")
    release_after_s: float = Field(description="And so long after (s).")
    factor: float
    foresight_s: float = Field(description="0: it does not look ahead.")

    @classmethod
    def of(cls, tried: parameters.Parameters) -> "TriedParameters":
        """The same."""
        return cls(
            confidence_threshold=tried.threshold,
            radius_m=tried.radius_m,
            release_beyond_m=tried.release_beyond_m,
            release_after_s=tried.release_after_s,
            factor=tried.factor,
            foresight_s=tried.foresight_s,
        )


class TriedOutcome(Model):
    """What came of it, of the whole fleet."""

    slowed_s: dict[str, float] = Field(
        description="Reason → seconds of a robot slowed."
    )
    encounters: dict[str, int] = Field(
        description="Reason → how often a robot was slowed."
    )
    near_misses: int
    near_s: float = Field(description="Unslowed near somebody (s).")
    lost_s: float = Field(description="Driving that was not driven (s).")
    missed_s: float | None = Field(
        description="Unslowed with somebody really within 2 m (s); null: not known."
    )
    false_s: float | None = Field(
        description="Slowed for a person with nobody really within 2.3 m (s)."
    )

    @classmethod
    def of(cls, found: outcome.Outcome) -> "TriedOutcome":
        """The same, with tenths of a second."""
        return cls(
            slowed_s={why: round(s, 1) for why, s in found.slowed_s.items()},
            encounters=dict(found.encounters),
            near_misses=found.near_misses,
            near_s=round(found.near_s, 1),
            lost_s=round(found.lost_s, 1),
            missed_s=rounded(found.missed_s, 1),
            false_s=rounded(found.false_s, 1),
        )


class TriedPoint(Model):
    """One point of the curve."""

    value: float
    outcome: TriedOutcome


class WhatIfAnswer(Model):
    """The answer to a question."""

    poses: int = Field(description="Rows that it rests on; ``detections`` likewise.")
    detections: int
    recorded_slowed_s: dict[str, float] = Field(
        description="Reason → seconds by the decisions of then."
    )
    recorded_encounters: dict[str, int]
    in_force: TriedOutcome
    candidate: TriedOutcome
    curve: list[TriedPoint]


class WhatIf(Model):
    """A question about another rule, and how far its answer is."""

    id: str
    by: str
    state: Literal["waiting", "running", "done", "failed", "cancelled"]
    progress: float = Field(description="0 to 1.")
    why: str | None
    since: str
    until: str
    vary: str
    in_force: TriedParameters
    candidate: TriedParameters
    answer: WhatIfAnswer | None

    @classmethod
    def of(cls, job: Job) -> "WhatIf":
        """As it stands."""
        asked = job.asked
        return cls(
            id=job.job_id,
            by=job.by,
            state=job.state,
            progress=round(job.progress, 3),
            why=job.why,
            since=format_stamp(asked.since),
            until=format_stamp(asked.until),
            vary="confidence_threshold" if asked.vary == "threshold" else asked.vary,
            in_force=TriedParameters.of(asked.in_force),
            candidate=TriedParameters.of(asked.candidate),
            answer=_answer(job),
        )


def _answer(job: Job) -> WhatIfAnswer | None:
    answer = job.answer
    if answer is None:
        return None
    in_force, candidate, *curve = map(TriedOutcome.of, answer.outcomes)
    was = TriedOutcome.of(answer.recorded)
    points = zip(job.asked.values, curve, strict=True)
    return WhatIfAnswer(
        poses=answer.poses,
        detections=answer.seen,
        recorded_slowed_s=was.slowed_s,
        recorded_encounters=was.encounters,
        in_force=in_force,
        candidate=candidate,
        curve=[TriedPoint(value=value, outcome=one) for value, one in points],
    )
