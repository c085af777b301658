"""A question "what if the rule were another", and its answer."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final, Literal

from iveg.domain.observations import Instant
from iveg.domain.what_if.outcome import Outcome
from iveg.domain.what_if.parameters import Parameters

State = Literal["waiting", "running", "done", "failed", "cancelled"]
Varied = Literal[
    "threshold",
    "radius_m",
    "release_beyond_m",
    "release_after_s",
    "factor",
    "foresight_s",
]
VALUES: Final[Mapping[Varied, tuple[float, ...]]] = MappingProxyType(
    {
        "threshold": (0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95),
        "radius_m": (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0),
        "release_beyond_m": (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0),
        "release_after_s": (0.0, 0.4, 1.0, 1.6, 2.0, 3.0),
        "factor": (0.25, 0.5, 0.75),
        "foresight_s": (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0),
    }
)
"""Values of each curve."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of a range.

    Attributes:
        outcomes: One for each of the parameters that were asked for, in their order.
        recorded: What was decided then, by the rule of then.
        poses: Rows of poses that it rests on; ``seen`` of detections.
    """

    outcomes: tuple[Outcome, ...]
    recorded: Outcome
    poses: int
    seen: int

    def __add__(self, other: "Answer") -> "Answer":
        """Of both ranges together."""
        pairs = zip(self.outcomes, other.outcomes, strict=True)
        return Answer(
            tuple(one + two for one, two in pairs),
            self.recorded + other.recorded,
            self.poses + other.poses,
            self.seen + other.seen,
        )


@dataclass(frozen=True, slots=True)
class Question:
    """What somebody asks.

    Attributes:
        since: Begin of the range (Unix s); ``until`` its end.
        in_force: Parameters of the rule in force.
        candidate: What is tried.
        vary: The parameter of the curve.
        values: Of the curve, rising.
    """

    since: float
    until: float
    in_force: Parameters
    candidate: Parameters
    vary: Varied
    values: tuple[float, ...]

    @property
    def tried(self) -> tuple[Parameters, ...]:
        """In force, tried, and the candidate with each value."""
        curve = (replace(self.candidate, **{self.vary: one}) for one in self.values)
        return self.in_force, self.candidate, *curve


@dataclass(slots=True)
class Job:
    """A question on its way.

    Attributes:
        progress: Share of the range that is judged (0 to 1).
        why: Of a failure: ``no_data``, or the neighbour that did not answer.
        answer: Of what is judged by now.
    """

    job_id: str
    by: str
    asked: Question
    asked_at: Instant
    state: State = "waiting"
    progress: float = 0.0
    why: str | None = None
    answer: Answer | None = field(default=None, repr=False)

    @property
    def is_over(self) -> bool:
        """Whether nothing will change any more."""
        return self.state not in ("waiting", "running")
