"""The paper's evaluation as a page sees it (docs/experiment.md)."""

from typing import Literal

from pydantic import Field

from iveg.models.base import Model


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
