"""How it stands with a robot, as every surface says it."""

from pydantic import Field

from iveg.domain.situation import facts
from iveg.models.base import Model, Slots


class Situation(Model):
    """The worst that holds for a robot now, and what a person can do."""

    level: facts.Level
    state: str = Field(description="Its sentence is `situation.is.{state}`.")
    cause: str = Field(description="The reason that is applied.")
    why: str | None = Field(description="Its sentence is `situation.why.{why}`.")
    about: str | None = Field(description="The person, robot or hold of the cause.")
    action: facts.Action = Field(description="Its sentence is `situation.do.{action}`.")
    factor: float | None = Field(description="The strictest speed factor in force.")
    slots: Slots

    @classmethod
    def of(cls, found: facts.Situation) -> "Situation":
        """As the domain found it."""
        return cls(
            level=found.level,
            state=found.state,
            cause=found.cause,
            why=found.why,
            about=found.about,
            action=found.action,
            factor=found.factor,
            slots=dict(found.slots),
        )
