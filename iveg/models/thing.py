"""Things that an operator marked as "not a person here" or "known here"."""

from typing import Literal

from pydantic import Field

from iveg.domain.known import LEARNT_RADIUS_M
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.domain.tracking import things
from iveg.models.base import Model


class Thing(Model):
    """One mark: who is born inside its circle and stays there slows nobody."""

    thing_id: str
    kind: Literal["person", "obstacle"] = Field(
        description="``person``: no person; ``obstacle``: known, whatever lasers see."
    )
    x: float = Field(description="Of its middle in ``map``.")
    y: float
    radius_m: float
    by: str
    since: str
    until: str = Field(description="When it ends at the latest.")

    @classmethod
    def of(cls, thing: things.Thing) -> "Thing":
        """One mark."""
        return cls(
            thing_id=thing.thing_id,
            kind=thing.kind,
            x=round(thing.x, 3),
            y=round(thing.y, 3),
            radius_m=things.RADIUS_M,
            by=thing.by,
            since=format_stamp(thing.since.wall),
            until=format_stamp(thing.until.wall),
        )


class KnownSpot(Model):
    """A place where what stands still slows nobody, in ``map``."""

    x: float
    y: float
    radius_m: float
    since: str = Field(description="When it became known.")
    thing_id: str | None = Field(
        description="The mark of an operator; null: lasers learnt it by themselves."
    )

    @classmethod
    def learnt(cls, x: float, y: float, since: Instant) -> "KnownSpot":
        """One that lasers learnt."""
        return cls(
            x=round(x, 3),
            y=round(y, 3),
            radius_m=LEARNT_RADIUS_M,
            since=format_stamp(since.wall),
            thing_id=None,
        )

    @classmethod
    def marked(cls, thing: things.Thing) -> "KnownSpot":
        """One that an operator marked."""
        return cls(
            x=round(thing.x, 3),
            y=round(thing.y, 3),
            radius_m=things.RADIUS_M,
            since=format_stamp(thing.since.wall),
            thing_id=thing.thing_id,
        )
