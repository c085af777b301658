"""The chain from robot to screen, hop by hop, and which hop is broken.

Each hop is judged by what went through it, never by what it says of itself: a canary
measure goes out over MQTT every two seconds and must come back as a notification
(safety.md §0.3, fault F4).
"""

from dataclasses import dataclass
from typing import Literal

from iveg.domain.observations import Instant

HopName = Literal["mqtt", "orion", "iot_agent", "notifications", "database"]
HopState = Literal["ok", "late", "down", "unknown"]

CANARY_PERIOD_S = 2.0
LATE_S, DOWN_S = 4.0, 5.5
GRACE_S = 6.0
"""After the start nobody is accused for this long."""


@dataclass(frozen=True, slots=True)
class Hop:
    """One hop's state, how old the evidence is (s), and a short detail."""

    name: HopName
    state: HopState
    age_s: float | None = None
    detail: str = ""


class Chain:
    """Collects the evidence.

    Attributes:
        mqtt_connected: Whether our own connection to the broker stands.
        orion_error: What the last question to Orion came to; empty when well.
        database: The recorder's state.
    """

    def __init__(self, start: Instant) -> None:
        self._start = start
        self.mqtt_connected = False
        self._was_connected = False
        self.orion_error = ""
        self.orion_ok_at: float | None = None
        self.agent_error = ""
        self.canary_at: float | None = None
        self.notified_at: float | None = None
        self.database: HopState = "unknown"

    def hops(self, now: Instant) -> list[Hop]:
        """Every hop, in the order in which a datum passes them."""
        return [
            self._mqtt(now),
            self._agent(now),
            self._orion(now),
            self._notifications(now),
            Hop("database", self.database),
        ]

    def _mqtt(self, now: Instant) -> Hop:
        if self.mqtt_connected:
            self._was_connected = True
            return Hop("mqtt", "ok")
        starting = now.mono - self._start.mono < GRACE_S
        return Hop(
            "mqtt", "unknown" if starting and not self._was_connected else "down"
        )

    def _orion(self, now: Instant) -> Hop:
        age = _age(self.orion_ok_at, now)
        if self.orion_error:
            return Hop("orion", "down", age, self.orion_error)
        if age is None:
            return Hop("orion", "unknown")
        return Hop("orion", "ok", age)

    def _agent(self, now: Instant) -> Hop:
        """Deaf or healthy: the canary knows, if the hops round it are well."""
        age = _age(self.canary_at, now)
        if self.agent_error:
            return Hop("iot_agent", "down", age, self.agent_error)
        state = self._by_age(age, now)
        if state != "ok" and (not self.mqtt_connected or self.orion_error):
            return Hop("iot_agent", "unknown", age)
        return Hop("iot_agent", state, age)

    def _notifications(self, now: Instant) -> Hop:
        age = _age(self.notified_at, now)
        state = self._by_age(age, now)
        if state != "ok" and self.orion_error:
            return Hop("notifications", "unknown", age)
        return Hop("notifications", state, age)

    def _by_age(self, age: float | None, now: Instant) -> HopState:
        if age is None:
            waited = now.mono - self._start.mono
            return "unknown" if waited < GRACE_S else "down"
        if age <= LATE_S:
            return "ok"
        return "late" if age <= DOWN_S else "down"


def _age(at: float | None, now: Instant) -> float | None:
    return None if at is None else max(0.0, now.mono - at)
