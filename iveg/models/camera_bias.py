"""How far off a robot's camera places its peers, for readers."""

from pydantic import Field

from iveg.domain.camera_bias import PeerLooks
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model


class CameraBias(Model):
    """Median error of its detections of other robots, by their own poses."""

    off_m: float
    ahead_m: float = Field(description="Seen farther ahead than they are.")
    left_m: float = Field(description="Seen farther to the left than they are.")
    looks: int
    last_at: str = Field(description="When it saw another robot last.")

    @classmethod
    def of(cls, looks: PeerLooks, now: Instant) -> "CameraBias | None":
        """At this moment; None: too few looks."""
        found = looks.bias(now)
        if found is None:
            return None
        return cls(
            off_m=round(found.off_m, 2),
            ahead_m=round(found.ahead_m, 2),
            left_m=round(found.left_m, 2),
            looks=found.looks,
            last_at=format_stamp(now.wall - (now.mono - found.last_at)),
        )
