"""Which transport feeds each robot, and which of Orion's copies are not needed.

Odometry and scans come twice, straight from MQTT (``direct``) and through Orion
(``fiware``; any other way counts as direct).  While the direct copy is fresh the other
is a fallback and the proof that the chain lives, and Orion may throttle it::

              direct without a gap for 5 s
    FULL ─────────────────────────────────────> THINNED
         <─────────────────────────────────────
              the broker is lost, or FIWARE still brings what the direct transport
              does not: nothing for 1 s, or only messages that are older by 0.2 s
              and more for 1 s

A robot that is silent on both transports changes nothing.
"""

from collections import defaultdict
from dataclasses import dataclass, field

from iveg.domain.observations import Observation, Odometry
from iveg.domain.transports import DIRECT, FIWARE, TransportId

SILENT_S = 1.0
"""A direct copy older than this is missed."""
OVERTAKES_S = 0.2
"""What comes through FIWARE that much after the last direct message is no twin; a
direct twin that comes no later than that is not behind, whichever was first."""
STEADY_S = 5.0


@dataclass(slots=True)
class Feed:
    """One kind of telemetry of one robot, on both transports (monotonic s).

    Attributes:
        direct_at: Arrival of the newest direct message; ``fiware_at`` of Orion's.
        thinned: Whether Orion's copy is not needed; None while nobody knows.
    """

    direct_at: float = float("-inf")
    fiware_at: float = float("-inf")
    thinned: bool | None = None
    _steady_since: float = float("-inf")
    _direct: TransportId = DIRECT.id
    _behind_since: float | None = None

    def heard(self, transport: TransportId, at: float, *, news: bool) -> None:
        """A message came.

        ``news``: it was newer than all before; of a direct one also, that none newer
        has come before it.
        """
        if transport != FIWARE.id:
            if at - self.direct_at > SILENT_S:
                self._steady_since = at
            self.direct_at, self._direct = at, transport
            since = self._behind_since
            if news and since is not None and at - since <= OVERTAKES_S:
                self._behind_since = None
            return
        self.fiware_at = at
        if not news or at - self.direct_at > SILENT_S:
            self._behind_since = None
        elif self._behind_since is None:
            self._behind_since = at

    def is_direct(self, now: float) -> bool:
        """Whether the direct copy is fresh."""
        return now - self.direct_at <= SILENT_S

    def transport(self, now: float) -> TransportId:
        """Which one brings what counts; of a silent robot, which one did."""
        if self.direct_at == float("-inf") or self._has_fallen_back(now):
            return FIWARE.id
        return self._direct

    def judge(self, now: float, *, connected: bool) -> bool | None:
        """Whether Orion's copy may be throttled from now on."""
        if not connected or self._has_fallen_back(now) or self._is_behind():
            self.thinned = False
            self._steady_since = now
        elif self.is_direct(now) and now - self._steady_since >= STEADY_S:
            self.thinned = True
        return self.thinned

    def _has_fallen_back(self, now: float) -> bool:
        """Whether FIWARE alone still brings it."""
        return not self.is_direct(now) and self.fiware_at > self.direct_at + OVERTAKES_S

    def _is_behind(self) -> bool:
        """Whether Orion's copies have been the newer ones for a while."""
        since = self._behind_since
        return since is not None and self.fiware_at - since >= 0.9 * SILENT_S


@dataclass(slots=True)
class Feeds:
    """The feeds of a fleet, by robot and kind."""

    _known: defaultdict[tuple[str, type[Observation]], Feed] = field(
        default_factory=lambda: defaultdict(Feed)
    )

    def of(self, robot_id: str, kind: type[Observation] = Odometry) -> Feed:
        """One feed."""
        return self._known[robot_id, kind]
