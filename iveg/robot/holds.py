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
        """Ids that a release from iVeg must name completely."""
        return frozenset(hold.id for hold in self.holds if hold.ack == "remote")

    @property
    def link_alone(self) -> Hold | None:
        """The ``link`` hold that may clear itself; None when there are other holds."""
        if len(self.holds) == 1 and self.holds[0].ack == "auto":
            return self.holds[0]
        return None

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
        ours = [hold for hold in self.holds if hold.source == "iveg"]
        if len(self.holds) <= MAX_HOLDS or len(ours) < 2:
            return self
        return replace(
            self,
            holds=tuple(hold for hold in self.holds if hold is not ours[0]),
            joined=(*self.joined, ours[0].id)[-RELEASED_KEPT:],
        )

    def lift(self, ids: Iterable[str]) -> "HoldSet":
        """The set without these holds; their ids are remembered as released.

        Joined STOPs are lifted together with the last STOP that they joined.
        """
        named = frozenset(ids)
        lifted = [hold.id for hold in self.holds if hold.id in named]
        kept = tuple(hold for hold in self.holds if hold.id not in named)
        held = any(hold.source == "iveg" for hold in kept)
        gone = () if held else self.joined
        released = (*self.released, *gone, *lifted)[-RELEASED_KEPT:]
        return HoldSet(kept, released, self.joined if held else ())

    def after_reboot(self) -> "HoldSet":
        """The set that a new start inherits: STOPs and local holds, no boot hold."""
        kept = tuple(hold for hold in self.holds if hold.source in _SURVIVES_REBOOT)
        return replace(self, holds=kept)


# --- hold file --------------------------------------------------------------------
#
# The robot's hold set on disk, written atomically.
#
# The file is written under another name, flushed and renamed, so a loss of power leaves
# the old set or the new one.  An unreadable file is not treated as an empty set.


class _StoredHolds(BaseModel):
    """The file; those of older versions lack ``joined``."""

    holds: tuple[Hold, ...]
    released: tuple[str, ...]
    joined: tuple[str, ...] = ()


def read_holds(file: Path) -> HoldSet | None:
    """The stored set; an empty one before the first start; None when unreadable."""
    try:
        stored = _StoredHolds.model_validate(load_json(file.read_bytes()))
    except FileNotFoundError:
        return HoldSet()
    except (OSError, UnreadableError, ValidationError):
        return None
    return HoldSet(stored.holds, stored.released, stored.joined)


def write_holds(file: Path, holds: HoldSet) -> None:
    """Store the set; on return it survives a loss of power.

    Raises:
        OSError: the disk refused; the file is as it was.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(file, orjson.dumps(holds))
