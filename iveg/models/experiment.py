"""The paper's evaluation as a page sees it (docs/experiment.md)."""

from typing import Literal

from pydantic import Field

from iveg.domain.records import Json
from iveg.models.base import Model


class Protected(Model):
    """People near moving robots, all runs together (docs/experiment.md, Protection)."""

    slowed: float | None = Field(
        description=(
            "Of the time within 2 m of a moving robot in some camera's view, the share "
            "(0 to 1) in which it was limited to half speed; null: nobody was near."
        )
    )
    encounters: int
    never_slowed: int = Field(
        description="Encounters in which the robot never was limited."
    )

    @classmethod
    def of(cls, numbers: Json) -> "Protected":
        """From the numbers of a result."""
        slowed = numbers["slowed"]["in_view"]
        counts = numbers["encounters"], numbers["never_slowed"]
        return cls(slowed=slowed, encounters=counts[0], never_slowed=counts[1])


class Experiment(Model):
    """One experiment, on its way or over."""

    name: str
    size: str
    state: Literal["running", "done", "broken"]
    run: str | None = Field(description="Which run it is at; null between two.")
    phase: Literal["counting", "running"] | None = Field(
        description="On the virtual clock, or in real time."
    )
    done: int
    of: int
    left_s: float = Field(description="About how long it still takes (s).")
    why: str = Field(
        description=(
            "Why it broke off, in a word or the program's own; empty where it did not."
        )
    )
    profile: str | None = Field(
        default=None, description="Of the emulated detector: ``field``, ``simulation``."
    )
    seed: int | None = Field(
        default=None, description="First seed; each run's own is in the report."
    )
    load: float | None = Field(
        default=None, description="Of the machine, mean of the last minute of it."
    )
    protected: Protected | None = Field(
        default=None, description="As far as it was scored; null: not yet."
    )
    began_at: str
    report: bool = Field(
        description=(
            "Whether there is something to open: the report, or what a break left."
        )
    )


class Experiments(Model):
    """All of them, newest first."""

    items: list[Experiment]
    refused: str | None = Field(
        description=(
            "Why none may be started now: ``running``, ``live_robot``; null: one may."
        )
    )
