"""One message that is followed through every hop, to be drawn as a waterfall.

One at a time, a new one every two seconds: what a page draws may be a later message
that took its place, and then that is what the trace says.
"""

from dataclasses import dataclass, replace
from math import isnan
from typing import Final

_EVERY_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class Trace:
    """When one message passed each hop, monotonic seconds of the server.

    Attributes:
        stamp: As the robot sent it.
        uplink_s: Δt₁ (s); None where its stamp does not count.
        heard_at: iVeg's own reading of the broker; the others None until they come.
    """

    seq: int
    stamp: str | None
    uplink_s: float | None
    heard_at: float
    notified_at: float | None = None
    decided_at: float | None = None
    painted_at: float | None = None


class Tracer:
    """Follows one message a while; ``newest`` is the last that was followed to its end.

    A trace begins at iVeg's own reading of the broker: without direct reading there is
    none.
    """

    def __init__(self) -> None:
        self.newest: Trace | None = None
        self._open: Trace | None = None

    def heard(self, seq: int, stamp: str | None, took: float, now: float) -> None:
        """A message at the first tap: perhaps the next that is followed."""
        following = self._open
        if following is not None and now - following.heard_at < _EVERY_S:
            return
        if following is not None and following.decided_at is not None:
            self.newest = following
        self._open = Trace(seq, stamp, None if isnan(took) else took, now)

    def notified(self, seq: int, now: float) -> None:
        """Orion has notified this one."""
        if self._open is not None and self._open.seq == seq:
            self._open = replace(self._open, notified_at=now)

    def decided(self, seq: int | None, now: float) -> None:
        """This one was decided on."""
        if self._open is not None and self._open.seq == seq:
            self._open = replace(self._open, decided_at=now)

    def painted(self, now: float) -> None:
        """A page has drawn it, or one that is newer."""
        one = self._open
        if one is not None and one.decided_at is not None and one.painted_at is None:
            self._open = replace(one, painted_at=now)
