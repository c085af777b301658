"""What keeps a robot from moving: a set of holds, and the holds that are no more.

A robot drives only with an empty set.  Every hold has a name; a release must name what
it lifts, and a name that was released once never holds again (docs/safety.md).
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from iveg.domain.observations import Hold

RELEASED_KEPT = 64
MAX_HOLDS = 48
"""Of the 64 that a report may carry; the rest is room for holds of the robot's own."""

_SURVIVES_REBOOT = frozenset({"iveg", "hw", "bumper"})


@dataclass(frozen=True, slots=True)
class HoldSet:
    """The holds of one robot.

    Attributes:
        holds: In the order they came.
        released: The last 64 released ids, newest last.
        joined: STOPs that hold through those in ``holds``, for which there was no more
            room: the oldest, so that whoever asks can read his own name in a report.
    """

    holds: tuple[Hold, ...] = ()
    released: tuple[str, ...] = ()
    joined: tuple[str, ...] = ()

    def find(self, hold_id: str) -> Hold | None:
        """The hold of that name, if it holds now."""
        return next((hold for hold in self.holds if hold.id == hold_id), None)

    @property
    def remote(self) -> frozenset[str]:
        """Ids that a release from iVeg must name, all of them."""
        return frozenset(hold.id for hold in self.holds if hold.ack == "remote")

    @property
    def link_alone(self) -> Hold | None:
        """The ``link`` hold that may still clear itself; None when others came."""
        if len(self.holds) == 1 and self.holds[0].ack == "auto":
            return self.holds[0]
        return None

    def latch(self, hold: Hold) -> "HoldSet":
        """One hold more; a ``link`` hold that is joined no longer clears itself."""
        earlier = tuple(
            replace(held, ack="remote") if held.ack == "auto" else held
            for held in self.holds
        )
        joined = tuple(name for name in self.joined if name != hold.id)
        return replace(self, holds=(*earlier, hold), joined=joined)._with_room()

    def _with_room(self) -> "HoldSet":
        """No more holds than a report may carry: the oldest STOP joins the others."""
        ours = [hold for hold in self.holds if hold.source == "iveg"]
        if len(self.holds) <= MAX_HOLDS or len(ours) < 2:
            return self
        return replace(
            self,
            holds=tuple(hold for hold in self.holds if hold is not ours[0]),
            joined=(*self.joined, ours[0].id)[-RELEASED_KEPT:],
        )

    def lift(self, ids: Iterable[str]) -> "HoldSet":
        """Without the holds of these names; the names are remembered as released.

        What has joined goes with the last STOP of those that it has joined.
        """
        named = frozenset(ids)
        lifted = [hold.id for hold in self.holds if hold.id in named]
        kept = tuple(hold for hold in self.holds if hold.id not in named)
        held = any(hold.source == "iveg" for hold in kept)
        gone = () if held else self.joined
        released = (*self.released, *gone, *lifted)[-RELEASED_KEPT:]
        return HoldSet(kept, released, self.joined if held else ())

    def after_reboot(self) -> "HoldSet":
        """What a new start inherits: STOPs and local holds, not yesterday's boot."""
        kept = tuple(hold for hold in self.holds if hold.source in _SURVIVES_REBOOT)
        return replace(self, holds=kept)
