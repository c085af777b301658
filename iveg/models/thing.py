"""Things that an operator marked as "not a person here"."""

from pydantic import Field

from iveg.domain.stamps import format_stamp
from iveg.domain.tracking import things
from iveg.models.base import Model


class Thing(Model):
    """One mark: who is born inside its circle and stays there slows nobody."""

    thing_id: str
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
            x=round(thing.x, 3),
            y=round(thing.y, 3),
            radius_m=things.RADIUS_M,
            by=thing.by,
            since=format_stamp(thing.since.wall),
            until=format_stamp(thing.until.wall),
        )
