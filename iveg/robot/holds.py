"""The holds that keep a robot from moving, and their file."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import orjson
from pydantic import BaseModel, ValidationError

from iveg.adapters.files import write_bytes
from iveg.domain.errors import UnreadableError
from iveg.domain.observations import Hold
from iveg.ngsi.codec import load_json

# --- holds ------------------------------------------------------------------------
#
# The set of holds that keeps a robot from moving, and the ids already released.
#
# A robot drives only with an empty set. Every hold has an id; a release must name the
# ids that it lifts, and a released id never holds again (docs/safety.md).

RELEASED_KEPT = 64
MAX_HOLDS = 48
"""A report may carry 64; the others are reserved for local holds."""

# A boot hold is made anew at each start; a link hold where iVeg is still silent.
_SURVIVES_REBOOT = frozenset({"iveg", "hw", "bumper"})


@dataclass(frozen=True, slots=True)
class HoldSet:
    """The holds of one robot.

    Attributes:
        holds: Those of a report, in the order in which they came.
        released: The last 64 released ids, newest last.
        joined: STOPs in force beyond the room of a report.  They are the oldest, so
            that the report names the newest STOP to the person who pressed it.
    """

    holds: tuple[Hold, ...] = ()
    released: tuple[str, ...] = ()
    joined: tuple[str, ...] = ()

    def find(self, hold_id: str) -> Hold | None:
        """The hold with this id; None when it is not in force."""
        return next((hold for hold in self.holds if hold.id == hold_id), None)

    @property
    def remote(self) -> frozenset[str]:
        """Ids that a release from iVeg must name completely."""
        return frozenset(hold.id for hold in self.holds if hold.ack == "remote")

    @property
    def link_alone(self) -> Hold | None:
        """The ``link`` hold that may clear itself; None when there are other holds."""
        is_link = [hold.ack for hold in self.holds] == ["auto"]
        return self.holds[0] if is_link else None

    def latch(self, hold: Hold) -> "HoldSet":
        """Add a hold; a ``link`` hold beside others no longer clears itself."""
        earlier = tuple(
            replace(held, ack="remote") if held.ack == "auto" else held
            for held in self.holds
        )
        joined = tuple(name for name in self.joined if name != hold.id)
        return replace(self, holds=(*earlier, hold), joined=joined)._with_room()

    def _with_room(self) -> "HoldSet":
        """Keep the set within the size of a report: the oldest STOP joins another."""
        stops = [hold for hold in self.holds if hold.source == "iveg"]
        # The last STOP stays: joined STOPs end with it.
        if len(self.holds) <= MAX_HOLDS or len(stops) < 2:
            return self
        return replace(
            self,
            holds=tuple(hold for hold in self.holds if hold is not stops[0]),
            joined=(*self.joined, stops[0].id)[-RELEASED_KEPT:],
        )

    def lift(self, ids: Iterable[str]) -> "HoldSet":
        """The set without these holds; their ids are remembered as released.

        Joined STOPs are lifted together with the last STOP that they joined.
        """
        named = frozenset(ids)
        lifted = [hold.id for hold in self.holds if hold.id in named]
        remaining = tuple(hold for hold in self.holds if hold.id not in named)
        has_stop = any(hold.source == "iveg" for hold in remaining)
        joined_stops = () if has_stop else self.joined
        released = (*self.released, *joined_stops, *lifted)[-RELEASED_KEPT:]
        return HoldSet(remaining, released, self.joined if has_stop else ())

    def after_reboot(self) -> "HoldSet":
        """The set that a new start inherits: STOPs and local holds, no boot hold."""
        lasting = tuple(hold for hold in self.holds if hold.source in _SURVIVES_REBOOT)
        return replace(self, holds=lasting)


# --- hold file --------------------------------------------------------------------
#
# The robot's hold set on disk, written atomically.
#
# The file is written under another name, flushed and renamed, so a loss of power leaves
# the old set or the new one.  An unreadable file counts as a STOP, not as an empty set.


class _StoredHolds(BaseModel):
    """The file; those of older versions lack ``joined``."""

    holds: tuple[Hold, ...]
    released: tuple[str, ...]
    joined: tuple[str, ...] = ()


def read_holds(file: Path) -> HoldSet | None:
    """The stored set; an empty one before the first start; None when unreadable."""
    try:
        stored = _StoredHolds.model_validate(load_json(file.read_bytes()))
    except FileNotFoundError:  # before the first start
        return HoldSet()
    except (OSError, UnreadableError, ValidationError):
        return None
    return HoldSet(stored.holds, stored.released, stored.joined)


def write_holds(file: Path, holds: HoldSet) -> None:
    """Store the set; on return it survives a loss of power.

    Raises:
        OSError: it cannot be written; the file is as it was.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(file, orjson.dumps(holds))
