"""Health of the data path from robot to screen, hop by hop.

Each hop is judged by the messages that passed it, never by its own state: a probe
measure goes out over MQTT every two seconds and must come back as a notification
(docs/faults.md, F4).  The last place that it reached tells which hop lost it::

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
# Two probe periods; down is within the 6 s of docs/faults.md, F4.
LATE_S, DOWN_S = 4.0, 5.5
GRACE_S = 6.0
"""Time after the start in which silence is not reported as down (s)."""
EARLIER_GRACE_S = 2.0
"""Time after the start from which unread rows of earlier runs count as unknown (s)."""
# A dead agent must be named, however slow it was before.
_LONGEST_GAP_S = 30.0


@dataclass(frozen=True, slots=True)
class HopHealth:
    """State of one hop, with its evidence.

    Attributes:
        age_s: Age of the evidence (s).
        detail: One short sentence.
        lag_s: Delay of measures at it (s); None where no probe shows it.
    """

    name: Hop
    state: HopState
    age_s: float | None = None
    detail: str = ""
    lag_s: float | None = None


class HealthMonitor:
    """Collects the evidence about each hop.

    Args:
        start: Start of iVeg.
        database: Reads the recorder's state.

    Attributes:
        mqtt_connected: Whether our own connection to the broker stands.
        mqtt_error: Reason why the broker did not confirm the last probe.
        orion_error: Error of the last request to Orion; empty when well.
        orion_slow: Delay of Orion's last answer, in words; empty when in time.
        orion_ok_at: Newest answer of Orion without an error (s, monotonic).
        agent_error: As ``orion_error``, of the IoT Agent; ``agent_slow`` likewise.
        agent_silent: Set where the agent takes requests and does not answer them.
        agent_warning: Advice to a person while all seems well.
        notify_error: Fault of the subscriptions at the last check.
        notify_detail: Orion's newest failure to deliver; may be long past.
        received_at: Return of the newest probe (s, monotonic).
        stored_at: Departure of the newest probe that Orion has (s, monotonic).
        notified_at: Newest notification of any kind (s, monotonic).
        probe: Lag of the whole chain.
        earlier_read: Whether alerts and log of earlier runs have been read.
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

    def received(self, origin: Origin, now: Instant) -> None:
        """Note that a probe came back as a notification."""
        if self.received_at is not None:
            self._gap_s = now.mono - self.received_at
        self.received_at = now.mono
        self.probe.returned(origin, now)

    def stored(self, origin: Origin) -> None:
        """Note that Orion has this probe; a probe of an earlier run proves nothing."""
        sent_at = self.probe.sent_at(origin)
        if sent_at is not None:
            self.stored_at = sent_at

    # --- the verdict --------------------------------------------------------------

    def hops(self, now: Instant) -> list[HopHealth]:
        """Health of every hop, in the order in which a datum passes them."""
        mqtt, orion = self._mqtt(now), self._orion(now)
        agent = self._agent(now, broken=mqtt.state == "down" or orion.state == "down")
        # Behind a broken hop silence is no fault of the notifications.
        blind = orion.state == "down" or agent.state != "ok"
        return [
            mqtt,
            agent,
            orion,
            self._notifications(now, blind=blind or mqtt.state == "down"),
            HopHealth(Hop.DATABASE, self._database()),
        ]

    def earlier(self, now: Instant) -> Earlier:
        """Whether alerts and log of earlier runs have been read."""
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
        """Whether a hop is down that Orion's commands pass on their way to robots."""
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
        """Health of the agent; by the probe alone where the hops around it are well.

        An agent that still passes measures is not down because it leaves requests
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
        """Lag of the agent (s); None: unknown.

        If Orion has a probe that did not come back, the notifications are at fault and
        the probe shows nothing of the agent.
        """
        if self.stored_at is not None and not self.probe.has_passed(self.stored_at):
            return None
        return self.probe.lag(now)

    def _agent_says(self, lag_s: float | None) -> tuple[HopState, str]:
        """State of an agent that passes measures; the lag counts first."""
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

        Behind a growing backlog, probes come back ever farther apart.
        """
        if not self._was_behind:
            return DOWN_S
        return min(_LONGEST_GAP_S, max(DOWN_S, 2 * self._gap_s))

    def is_overloaded(self, now: Instant) -> bool:
        """Whether measures pass the agent late, so that nothing may add to its load."""
        _, state = self._passing(now)
        return state in ("ok", "late") and self._was_behind

    def _passing(self, now: Instant) -> tuple[float | None, HopState]:
        """Age of the newest measure that passed the agent (s), and the state by it."""
        moments = [at for at in (self.received_at, self.stored_at) if at is not None]
        age = _age(max(moments, default=None), now)
        return age, self._by_age(age, now, self._agent_down_s)

    def _notifications(self, now: Instant, *, blind: bool) -> HopHealth:
        age = _age(self.notified_at, now)
        state = self._by_age(age, now)
        if state == "ok":
            hop_state: HopState = "down" if self.notify_error else "ok"
            return HopHealth(Hop.NOTIFICATIONS, hop_state, age, self.notify_error)
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
