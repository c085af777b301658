"""Health of the data path from robot to screen, hop by hop.

Each hop is judged by what went through it, never by its own word: a probe measure goes
out over MQTT every two seconds and must come back as a notification (docs/faults.md,
F4).  The last place where it was seen tells which hop lost it::

    broker confirms it    →  the broker lives
    it is stored at Orion →  the agent receives and Orion stores
    it came back          →  notifications arrive

A hop behind a broken one is unknown, never reported as the cause.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from iveg.domain.observations import Instant, Origin
from iveg.domain.probe import SLOW_S, Hop, ProbeLag, lag_in_words, stopped_in_words

HopState = Literal["ok", "late", "down", "unknown"]
Earlier = Literal["known", "reading", "unknown"]

PROBE_PERIOD_S = 2.0
LATE_S, DOWN_S = 4.0, 5.5
GRACE_S = 6.0
"""For this long after the start no hop is reported as down."""
EARLIER_GRACE_S = 2.0
"""A history that has not told what earlier runs left by then is said to be missing."""
_LONGEST_GAP_S = 30.0


@dataclass(frozen=True, slots=True)
class HopHealth:
    """One hop's state and why.

    Attributes:
        age_s: How old the evidence is (s).
        detail: One short sentence.
        lag_s: How late measures pass it (s); None where no probe tells.
    """

    name: Hop
    state: HopState
    age_s: float | None = None
    detail: str = ""
    lag_s: float | None = None


class HealthMonitor:
    """Collects the evidence about each hop.

    Args:
        start: When iVeg started.
        database: The recorder's state.

    Attributes:
        mqtt_connected: Whether our own connection to the broker stands.
        mqtt_error: Why the broker did not confirm the last probe.
        orion_error: What the last question to Orion came to; empty when well.
        orion_slow: That it answers, and how late.
        agent_error: The same of the IoT Agent; ``agent_slow`` too.
        agent_silent: That the agent takes questions and does not answer them.
        agent_warning: What a person should look at though all seems well.
        notify_error: What was wrong with the subscriptions when last looked at.
        notify_detail: Why Orion could not deliver, as it remembers; may be long past.
        received_at: When the newest probe came back (s, monotonic).
        stored_at: When the newest probe that Orion has was sent (s, monotonic).
        notified_at: When the newest notification of any kind came (s, monotonic).
        probe: How far the whole chain is behind.
        earlier_read: Whether what earlier runs left in the history is taken up.
    """

    def __init__(self, start: Instant, database: Callable[[], HopState]) -> None:
        self._start = start
        self._database = database
        self.mqtt_connected = False
        self.mqtt_error = ""
        self.orion_error = self.orion_slow = ""
        self.orion_ok_at: float | None = None
        self.agent_error = self.agent_silent = ""
        self.agent_slow = self.agent_warning = ""
        self.notify_error = self.notify_detail = ""
        self.received_at: float | None = None
        self.stored_at: float | None = None
        self.notified_at: float | None = None
        self.probe = ProbeLag()
        self._gap_s = 0.0
        self.earlier_read = False

    # --- the heartbeat probe --------------------------------------------------------

    def sent(self, origin: Origin, now: Instant) -> None:
        """A probe leaves."""
        self.probe.sent(origin, now)

    def received(self, origin: Origin, now: Instant) -> None:
        """A probe has come back as a notification."""
        if self.received_at is not None:
            self._gap_s = now.mono - self.received_at
        self.received_at = now.mono
        self.probe.returned(origin, now)

    def stored(self, origin: Origin) -> None:
        """Orion has this probe; one of an earlier life of iVeg proves nothing."""
        left = self.probe.sent_at(origin)
        if left is not None:
            self.stored_at = left

    # --- the verdict --------------------------------------------------------------

    def hops(self, now: Instant) -> list[HopHealth]:
        """Every hop, in the order in which a datum passes them."""
        mqtt, orion = self._mqtt(now), self._orion(now)
        agent = self._agent(now, broken=mqtt.state == "down" or orion.state == "down")
        blind = orion.state == "down" or agent.state != "ok"
        return [
            mqtt,
            agent,
            orion,
            self._notifications(now, blind=blind or mqtt.state == "down"),
            HopHealth(Hop.DATABASE, self._database()),
        ]

    def earlier(self, now: Instant) -> Earlier:
        """Whether alerts and log of earlier runs are known."""
        if self.earlier_read:
            return "known"
        is_young = now.mono - self._start.mono < EARLIER_GRACE_S
        return "reading" if is_young else "unknown"

    def whole(self, now: Instant) -> bool:
        """Whether every hop of FIWARE is well."""
        return all(
            hop.state == "ok" for hop in self.hops(now) if hop.name is not Hop.DATABASE
        )

    def is_cut(self, now: Instant) -> bool:
        """Whether it is known that Orion's commands do not reach the robots."""
        down = {hop.name for hop in self.hops(now) if hop.state == "down"}
        return not down.isdisjoint((Hop.MQTT, Hop.AGENT))

    def _mqtt(self, now: Instant) -> HopHealth:
        if self.mqtt_connected:
            state: HopState = "down" if self.mqtt_error else "ok"
            return HopHealth(Hop.MQTT, state, detail=self.mqtt_error)
        if self._starting(now):
            return HopHealth(Hop.MQTT, "unknown")
        return HopHealth(Hop.MQTT, "down", detail="not connected")

    def _orion(self, now: Instant) -> HopHealth:
        age = _age(self.orion_ok_at, now)
        if self.orion_error:
            return HopHealth(Hop.ORION, "down", age, self.orion_error)
        if self.orion_slow:
            return HopHealth(Hop.ORION, "late", age, self.orion_slow)
        return HopHealth(Hop.ORION, "unknown" if age is None else "ok", age)

    def _agent(self, now: Instant, *, broken: bool) -> HopHealth:
        """Deaf, overloaded or healthy: the probe knows, if the hops round it are well.

        An agent that measures still pass is not down because it leaves requests
        unanswered: under load it answers them last.
        """
        age, state = self._passing(now)
        if self.agent_error:
            return HopHealth(Hop.AGENT, "down", age, self.agent_error)
        if broken and state != "ok":
            return HopHealth(Hop.AGENT, "unknown", age)
        lag = self._lag(now)
        if state == "ok" or (state == "late" and self._was_behind):
            state, detail = self._agent_says(lag)
        else:
            detail = "" if state == "unknown" else stopped_in_words(lag)
        return HopHealth(Hop.AGENT, state, age, detail, lag)

    def _lag(self, now: Instant) -> float | None:
        """Lag of the agent (s).

        For a probe that Orion has and that did not come back, notifications are at
        fault, and the lag of the agent is unknown.
        """
        if self.stored_at is not None and not self.probe.has_passed(self.stored_at):
            return None
        return self.probe.lag(now)

    def _agent_says(self, lag_s: float | None) -> tuple[HopState, str]:
        """State of an agent that measures pass, with the lag first."""
        if lag_s is not None and lag_s > SLOW_S:
            return "late", lag_in_words(lag_s)
        if self.agent_silent:
            return "down", self.agent_silent
        detail = self.agent_slow or self.agent_warning
        return ("late", detail) if detail else ("ok", "")

    @property
    def _was_behind(self) -> bool:
        return self.probe.transit_s > SLOW_S

    @property
    def _agent_down_s(self) -> float:
        """Silence after which the agent counts as down and not merely behind (s).

        Behind a backlog that grows, probes come back ever farther apart.
        """
        if not self._was_behind:
            return DOWN_S
        return min(_LONGEST_GAP_S, max(DOWN_S, 2 * self._gap_s))

    def is_overloaded(self, now: Instant) -> bool:
        """Whether measures pass the agent late: nothing may be added to it."""
        _, state = self._passing(now)
        return state in ("ok", "late") and self._was_behind

    def _passing(self, now: Instant) -> tuple[float | None, HopState]:
        """Age of the newest measure that passed the agent (s), and its verdict."""
        passed = [at for at in (self.received_at, self.stored_at) if at is not None]
        age = _age(max(passed, default=None), now)
        return age, self._by_age(age, now, self._agent_down_s)

    def _notifications(self, now: Instant, *, blind: bool) -> HopHealth:
        age = _age(self.notified_at, now)
        state = self._by_age(age, now)
        if state == "ok":
            missed: HopState = "down" if self.notify_error else "ok"
            return HopHealth(Hop.NOTIFICATIONS, missed, age, self.notify_error)
        if blind:
            return HopHealth(Hop.NOTIFICATIONS, "unknown", age)
        detail = self.notify_error or self.notify_detail
        return HopHealth(Hop.NOTIFICATIONS, state, age, detail)

    def _by_age(
        self, age: float | None, now: Instant, down_s: float = DOWN_S
    ) -> HopState:
        if age is None:
            return "unknown" if self._starting(now) else "down"
        if age <= LATE_S:
            return "ok"
        return "late" if age <= down_s else "down"

    def _starting(self, now: Instant) -> bool:
        return now.mono - self._start.mono < GRACE_S


def _age(at: float | None, now: Instant) -> float | None:
    return None if at is None else max(0.0, now.mono - at)
