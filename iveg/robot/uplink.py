"""All that a robot sends: safety messages in a lane of their own, and Algorithm 1."""

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field, replace
from operator import itemgetter

from iveg.domain.errors import HopError
from iveg.domain.kinds import KIND_OF, MEASURED
from iveg.domain.observations import (
    CommandAnswer,
    FeedbackRef,
    GoalAnswer,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Origin,
    SafetyReport,
    Unplaced,
)
from iveg.ngsi import codec, names
from iveg.robot.holds import HoldSet

# --- rates ------------------------------------------------------------------------
#
# Rates of telemetry that a robot sends through the IoT Agent.
#
# One agent carries about 150 measures a second; two robots at 30 Hz send 180.  iVeg
# reports Orion's backlog, and a robot that learns of one sends less, scans first::
#
#     level  0 ───────────── 1 ───────────── 2 ───────────── 3
#     scans  all ──> 1 Hz    1 Hz            1 Hz            1 Hz
#     camera all             all ──> 3 Hz    3 Hz            3 Hz
#     poses  all             all             all ──> 5 Hz    5 Hz
#
# The level rises while the backlog lasts and falls slowly afterwards. No reported
# backlog can raise a rate above the sensor's own or lower it below these floors. Safety
# reports are never fewer. Messages held back still go to iVeg directly.

TOP_HZ = 30.0
FLOOR_HZ = dict(
    sorted(
        ((kind.suffix or "", kind.floor_hz) for kind in MEASURED if kind.floor_hz),
        key=itemgetter(1),
    )
)
"""Least rates by device (Hz); the device with the lowest gives way first."""
LEVELS = float(len(FLOOR_HZ))

BEHIND_S, WELL_S = 0.5, 0.25
"""Lag (s) that counts as a backlog, and as none; between the two the level stays."""
FAR_BEHIND_S = 3.0
RISE_PER_S, RISE_FAR_PER_S, SINK_PER_S = 0.5, 1.0, 0.02
PATIENCE_S = 10.0
"""Time without a backlog before the level falls (s)."""
# A backlog that is reported after a long silence counts for this long, not for all.
_LONGEST_STEP_S = 0.5


@dataclass(slots=True)
class UplinkRates:
    """Decides which message is a measure; every other is sent to iVeg alone.

    All moments are monotonic (s).

    Attributes:
        level: 0: every message is a measure; 3: all rates are at their floors.
    """

    level: float = 0.0
    _noted_at: float | None = None
    _well_since: float | None = None
    _due: dict[str, float] = field(default_factory=dict)

    def note_backlog(self, backlog_s: float | None, now: float) -> None:
        """Take Orion's reported lag; None, when unknown, changes nothing."""
        before, self._noted_at = self._noted_at, now
        if backlog_s is None or before is None:
            return
        dt = min(max(0.0, now - before), _LONGEST_STEP_S)
        if backlog_s >= BEHIND_S:
            self._rise(backlog_s, dt)
        elif backlog_s > WELL_S:
            self._well_since = None
        else:
            self._sink(now, dt)

    def _rise(self, backlog_s: float, dt: float) -> None:
        self._well_since = None
        speed = RISE_FAR_PER_S if backlog_s >= FAR_BEHIND_S else RISE_PER_S
        self.level = min(LEVELS, self.level + speed * dt)

    def _sink(self, now: float, dt: float) -> None:
        if self._well_since is None:
            self._well_since = now
        if now - self._well_since >= PATIENCE_S:
            self.level = max(0.0, self.level - SINK_PER_S * dt)

    def is_measure(self, suffix: str, now: float) -> bool:
        """Whether a device's message goes to the agent."""
        interval = self._interval_s(suffix)
        due = self._due.get(suffix, now)
        if now < due:
            return False
        # A late message is compensated, so that the mean rate is kept, not exceeded.
        self._due[suffix] = max(due, now - interval) + interval
        return True

    def _interval_s(self, suffix: str) -> float:
        """Least time between two measures of a device (s); 0: every message is one."""
        if suffix not in FLOOR_HZ:
            return 0.0
        # From the sensor's own rate (0) to its floor (1).
        share = min(1.0, self.level - list(FLOOR_HZ).index(suffix))
        slower = float((TOP_HZ / FLOOR_HZ[suffix]) ** share)
        return slower / TOP_HZ if share > 0.0 else 0.0


# --- lane -------------------------------------------------------------------------
#
# Outgoing safety messages: disk before answer, answers in order, newest report wins.
#
# Telemetry has its own slots in the MQTT link, so no amount of pending telemetry delays
# or drops a safety message.

_log = logging.getLogger(__name__)
_MAX_ANSWERS = 256
_UNDER_WAY = 16
"""Most messages that await the broker's confirmation.  With one at a time a radio that
takes half a second each way carries one report a second, too few for a standstill."""


LaneMessage = tuple[str, bytes]
"""Topic and payload of a message at QoS 1."""


class SafetyLane:
    """Keeps the hold set and sends answers and reports, in that order.

    Args:
        keep: Writes a hold set to disk; called in a thread, may raise OSError.
        publish: Sends at QoS 1; raises HopError while the broker is away.
    """

    def __init__(
        self,
        keep: Callable[[HoldSet], None],
        publish: Callable[[str, bytes], Awaitable[None]],
    ) -> None:
        self._keep, self._publish = keep, publish
        self._to_keep: HoldSet | None = None
        self._answers: deque[LaneMessage] = deque(maxlen=_MAX_ANSWERS)
        self._kept_answers: deque[LaneMessage] = deque(maxlen=_MAX_ANSWERS)
        self._reports: dict[str, LaneMessage] = {}
        self._keep_wake, self._send_wake = asyncio.Event(), asyncio.Event()
        self._room = asyncio.Semaphore(_UNDER_WAY)

    def persist(self, holds: HoldSet) -> None:
        """Store this set; only the newest is pending, since it replaces all before."""
        self._to_keep = holds
        self._keep_wake.set()

    def answer(self, message: LaneMessage) -> None:
        """Send once the hold set that it refers to is on disk; drops the oldest."""
        self._answers.append(message)
        self._keep_wake.set()

    def report(self, message: LaneMessage) -> None:
        """Send when possible; a newer report of the same topic replaces it."""
        self._reports[message[0]] = message
        self._send_wake.set()

    async def keep_forever(self) -> None:
        """Write sets and release answers until cancelled."""
        while True:
            await self._keep_wake.wait()
            self._keep_wake.clear()
            holds, self._to_keep = self._to_keep, None
            answers = list(self._answers)
            self._answers.clear()
            if holds is not None:
                await asyncio.to_thread(self._keep_once, holds)
            self._kept_answers.extend(answers)
            self._send_wake.set()

    def _keep_once(self, holds: HoldSet) -> None:
        # A full disk must not silence the robot: it is held in memory all the same,
        # and it will boot held whatever the file says.
        try:
            self._keep(holds)
        except OSError as error:
            _log.warning("the hold file cannot be written: %s", error)

    async def send_forever(self) -> None:
        """Publish answers, then the newest report, until cancelled."""
        async with asyncio.TaskGroup() as sending:
            while True:
                await self._send_wake.wait()
                self._send_wake.clear()
                while self._kept_answers or self._reports:
                    await self._room.acquire()
                    # Tasks begin in this order, and each is on its way at once.
                    sending.create_task(self._send(self._next()))

    def _next(self) -> LaneMessage:
        if self._kept_answers:
            return self._kept_answers.popleft()
        return self._reports.pop(next(iter(self._reports)))

    async def _send(self, message: LaneMessage) -> None:
        try:
            await self._publish(*message)
        except HopError:
            pass  # lost while the broker is away; the next report has the state
        finally:
            self._room.release()


# --- uplink -----------------------------------------------------------------------
#
# Algorithm 1: the robot's observations on their way to iVeg.
#
# Every observation gets its origin here (boot, count of its topic, the robot's clock)
# and becomes a measure. Telemetry goes at QoS 0 and only the newest of a topic is
# pending; a message that the broker could not take is not sent later, because it is
# outdated by then. While Orion is behind, measures withheld from the agent go to iVeg
# directly (``rates``).

_UNPLACED = {"odometry": Odometry, "scan": LaserScan}
_SAFETY = KIND_OF[SafetyReport].suffix or ""
_ANSWERS, _GOALS = "cmdexe", "goal"
_LEAST_APART_S = 1e-4
"""Least time between two moments of a topic (s): iVeg requires that they rise."""


@dataclass(frozen=True, slots=True)
class Sender:
    """A start of a robot, as its messages name it.

    Attributes:
        robot_id: This robot.
        apikey: First part of its topics.
        boot: Random text of this start.
        first_report: ``seq`` of the first safety report; random, so that a number from
            an earlier boot is not taken for one of this.
        replay: The map frame of a recording, by which its messages are marked.
    """

    robot_id: str
    apikey: str
    boot: str
    first_report: int = 1
    replay: str | None = None


class Uplink:
    """Turns observations into messages, each with its boot and ``seq``.

    Args:
        sender: This start of this robot.
        enqueue: Takes telemetry; the newest of a topic wins.
        echoes: Returns the newest feedback of each author that had come by a moment
            (s since boot), the author known longest first; None for recordings, which
            prove no age.

    Moments are the robot's own: monotonic seconds since its boot, and its wall clock.
    """

    def __init__(
        self,
        sender: Sender,
        enqueue: Callable[[str, bytes], None],
        echoes: Callable[[float], tuple[FeedbackRef, ...]] | None = None,
    ) -> None:
        self._sender, self._enqueue, self._echoes = sender, enqueue, echoes
        self._newest = {_SAFETY: (sender.first_report - 1, 0.0)}
        """``seq`` and moment (s since boot) of the newest message of each topic."""
        self.rates = UplinkRates()

    def send(self, observation: Observation, at: Instant, age_s: float = 0.0) -> None:
        """Send an observation that was measured ``age_s`` ago (s)."""
        suffix = _suffix_of(observation)
        origin = self._origin(suffix, at, age_s)
        stamped = replace(observation, robot_id=self._sender.robot_id, origin=origin)
        payload = codec.write_measure(stamped)
        if self.rates.is_measure(suffix, at.mono):
            self._enqueue(self._topic(suffix), payload)
        else:
            self._enqueue(names.direct_topic(self._sender.robot_id, suffix), payload)

    def report(
        self, report: SafetyReport, at: Instant, *, is_measure: bool = True
    ) -> tuple[int, list[LaneMessage]]:
        """Build a safety report: ``seq`` and messages, the direct message first.

        Both have the same bytes: the first to arrive counts.
        """
        origin = self._origin(_SAFETY, at)
        payload = codec.write_measure(replace(report, origin=origin))
        messages = [(names.direct_topic(self._sender.robot_id, _SAFETY), payload)]
        if is_measure:
            messages.append((self._topic(_SAFETY), payload))
        return origin.seq or 0, messages

    def answer(self, answer: CommandAnswer | GoalAnswer, at: Instant) -> LaneMessage:
        """The message of an answer on ``cmdexe``."""
        count = _GOALS if isinstance(answer, GoalAnswer) else _ANSWERS
        origin = self._origin(count, at)
        topic = names.answer_topic(self._sender.apikey, self._sender.robot_id)
        return topic, codec.write_answer(replace(answer, origin=origin))

    def _origin(self, suffix: str, at: Instant, age_s: float = 0.0) -> Origin:
        """Origin of the next message of a topic, at its measurement."""
        count, before = self._newest.get(suffix, (0, 0.0))
        echoes = None if self._echoes is None else self._echoes(at.mono - age_s)
        # Ages by stamps are no clock: after a stamp that fell, moments still rise.
        measured = at.later(max(-age_s, min(0.0, before + _LEAST_APART_S - at.mono)))
        self._newest[suffix] = count + 1, measured.mono
        return Origin(
            self._sender.boot,
            count + 1,
            codec.format_stamp(measured.wall),
            measured.wall,
            measured.mono,
            acknowledgements=echoes is not None,
            heard=echoes[0] if echoes else None,
            heard_also=echoes[1:] if echoes else (),
            replay=self._sender.replay,
        )

    def _topic(self, suffix: str) -> str:
        return names.measure_topic(self._sender.apikey, self._sender.robot_id + suffix)


def _suffix_of(observation: Observation) -> str:
    """Suffix of the device that the observation is a measure of."""
    kind = type(observation)
    if isinstance(observation, Unplaced):
        kind = _UNPLACED[observation.kind]
    return KIND_OF[kind].suffix or ""
