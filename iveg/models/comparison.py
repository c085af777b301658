"""Two versions of the rule on the same inputs, and what each did."""

from typing import Literal

from pydantic import Field

from iveg.domain import comparison
from iveg.domain.rule import trial
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, stamp


class Doings(Model):
    """What one version of the rule did over a range."""

    slowed_s: dict[str, float] = Field(
        description="Reason → seconds of a robot at half speed."
    )
    encounters: dict[str, int] = Field(
        description="Reason → how often a robot was slowed."
    )

    @classmethod
    def of(cls, done: comparison.Doings) -> "Doings":
        """One version's."""
        seconds = {why: round(s, 1) for why, s in done.slowed_s.items()}
        return cls(slowed_s=seconds, encounters=dict(done.encounters))


class Comparison(Model):
    """A candidate beside the version in force, on the same inputs."""

    since: str
    until: str
    against: int = Field(description="The version that was in force.")
    compared_s: float = Field(description="Time of the range that was compared (s).")
    in_force: Doings
    candidate: Doings
    would_slow: int = Field(
        description="How often the candidate alone would have slowed a robot."
    )
    would_not: int = Field(description="How often it alone would not have.")

    @classmethod
    def of(cls, found: comparison.Comparison) -> "Comparison":
        """One of them."""
        return cls(
            since=format_stamp(found.since),
            until=format_stamp(found.until),
            against=found.against,
            compared_s=round(found.compared_s, 1),
            in_force=Doings.of(found.in_force),
            candidate=Doings.of(found.candidate),
            would_slow=found.would_slow,
            would_not=found.would_not,
        )


class TrialDifference(Model):
    """A time in which candidate and rule in force would tell a robot otherwise."""

    robot_id: str
    kind: Literal["slows", "frees"] = Field(
        description="The candidate alone would slow it; it alone would not."
    )
    reason: str
    cause: str | None
    decision_id: str | None
    began: str
    ended: str | None

    @classmethod
    def of(cls, one: trial.Difference) -> "TrialDifference":
        """One of them."""
        return cls(
            robot_id=one.robot_id,
            kind=one.kind,
            reason=one.reason,
            cause=one.cause,
            decision_id=one.decision_id,
            began=format_stamp(one.began),
            ended=stamp(one.ended),
        )


def compared(found: comparison.Comparison | None) -> Comparison | None:
    """What came of a trial, if there was one."""
    return None if found is None else Comparison.of(found)
