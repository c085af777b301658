"""Keeps the air: tells pages of each reading, and remembers one a minute.

Air changes slowly, so a day is 1,440 rows.  A reading is looked for once a second, as
the page shows its age in seconds.
"""

import asyncio
from typing import Protocol

from iveg.domain.observations import Climate, Instant
from iveg.domain.records import ClimateRecord
from iveg.pipeline.publish import Hub
from iveg.pipeline.record import RecordSink

PERIOD_S = 60.0
_LOOK_S = 1.0


class Air(Protocol):
    """What knows the newest reading; ``World`` is one."""

    climate: Climate | None
    climate_received: Instant | None


class ClimateKeeper:
    """Looks at the newest reading; one for the life of the server."""

    def __init__(self, air: Air, sink: RecordSink, hub: Hub) -> None:
        self._air = air
        self._sink = sink
        self._hub = hub
        self._told: Instant | None = None
        self._kept: float | None = None

    async def run(self) -> None:
        """Until cancelled."""
        while True:
            self.look()
            await asyncio.sleep(_LOOK_S)

    def look(self) -> None:
        """Tell of a reading that is new, and remember it if a minute has passed."""
        climate, received = self._air.climate, self._air.climate_received
        if climate is None or received is None or received == self._told:
            return
        self._told = received
        self._hub.changed("climate")
        # Devices that send every minute are late as often as early.
        if self._kept is None or received.mono - self._kept >= 0.9 * PERIOD_S:
            self._kept = received.mono
            self._sink.offer(
                ClimateRecord(
                    at=received.wall,
                    temperature=climate.temperature,
                    relative_humidity=climate.relative_humidity,
                    co2=climate.co2,
                )
            )
