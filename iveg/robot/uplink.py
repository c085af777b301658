"""Algorithm 1: the robot's observations on their way to iVeg.

Every observation gets its origin here (boot, count of its topic, the robot's clock) and
becomes a measure.  Telemetry goes at QoS 0 and only the newest of a topic is pending;
a message that the broker could not take is not sent later, because it is outdated by
then.  While Orion is behind, measures withheld from the agent go to iVeg directly
(``rates``).
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import fields, replace
from functools import lru_cache
from operator import attrgetter
from typing import Any, Literal

from iveg.domain.kinds import KIND_OF, SENSED
from iveg.domain.observations import (
    CommandAnswer,
    DetectionFrame,
    GoalAnswer,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    SafetyReport,
    Unplaced,
)
from iveg.ngsi import codec, names
from iveg.robot.echo import Echo
from iveg.robot.lane import LaneMessage
from iveg.robot.rates import UplinkRates
from iveg.robot.single import SinglePayload

_IN_ONE = Odometry, LaserScan, DetectionFrame
"""What the single payload of Algorithm 1 holds."""
Form = Literal["per-topic", "single"]

_WRITERS: dict[type, Callable[[Any], bytes]] = {
    Odometry: codec.write_odometry,
    LaserScan: codec.write_scan,
    DetectionFrame: codec.write_detections,
    Navigation: codec.write_navigation,
    Unplaced: codec.write_unplaced,
    **{one.of: codec.write_sensed for one in SENSED},
}
_UNPLACED = {"odometry": Odometry, "scan": LaserScan}
_SAFETY = KIND_OF[SafetyReport].suffix or ""
_ANSWERS, _GOALS = "cmdexe", "goal"
_SAID = {
    kind: attrgetter(*(one.name for one in fields(kind) if one.name != "robot_id"))
    for kind in _WRITERS
}
"""Fields of an observation except the robot's id; the origin comes first."""


class Uplink:
    """Turns observations into messages, each with its place in the count.

    Args:
        robot_id: This robot.
        apikey: First part of its topics.
        boot: Random text of this start.
        enqueue: Takes telemetry; the newest of a topic wins.
        form: One message a topic, or Algorithm 1's single payload.
        first_report: ``seq`` of the first safety report; random, so that a number from
            an earlier boot is not taken for one of this.
        echo: Newest feedback received; None for recordings, which prove no age.
        replay: The map frame of a recording, by which its messages are marked.

    Moments are the robot's own: monotonic seconds since its boot, and its wall clock.
    """

    def __init__(
        self,
        robot_id: str,
        apikey: str,
        boot: str,
        enqueue: Callable[[str, bytes], None],
        *,
        form: Form = "per-topic",
        first_report: int = 1,
        echo: Echo | None = None,
        replay: str | None = None,
    ) -> None:
        self._id = robot_id
        self._apikey = apikey
        self._boot = boot
        self._enqueue = enqueue
        self._echo = echo
        self._replay = replay
        self._single = SinglePayload(robot_id) if form == "single" else None
        self._next: Counter[str] = Counter({_SAFETY: first_report - 1})
        self._looked: tuple[tuple[str, int], ...] = ()
        self.rates = UplinkRates()

    def send(self, observation: Observation, at: Instant) -> None:
        """Send an observation of this moment."""
        if self._single is not None and isinstance(observation, _IN_ONE):
            self._send_single(self._single, observation, at)
            return
        news = isinstance(observation, DetectionFrame) and self._is_news(observation)
        suffix = _suffix_of(observation)
        stamped = self._stamped(observation, self._origin(suffix, at))
        payload = _WRITERS[type(observation)](stamped)
        self._emit(suffix, payload, at.mono, news=news)

    def _stamped(self, observation: Observation, origin: Origin) -> Observation:
        """Same result as ``dataclasses.replace`` at a third of its cost."""
        kind = type(observation)
        return kind(self._id, origin, *_SAID[kind](observation)[1:])

    def _is_news(self, frame: DetectionFrame) -> bool:
        """Whether the detected classes or their level of confidence changed."""
        before, self._looked = self._looked, _seen(frame)
        return self._looked != before

    def report(
        self, report: SafetyReport, at: Instant, *, is_measure: bool = True
    ) -> tuple[int, list[LaneMessage]]:
        """Build a safety report: its ``seq`` and its messages, the direct one first.

        Both have the same bytes: the first to arrive counts.
        """
        origin = self._origin(_SAFETY, at)
        payload = codec.write_safety(replace(report, origin=origin))
        messages = [LaneMessage(names.direct_topic(self._id, _SAFETY), payload)]
        if is_measure:
            messages.append(LaneMessage(self._topic(_SAFETY), payload))
        return origin.seq or 0, messages

    def answer(self, answer: CommandAnswer, at: Instant) -> LaneMessage:
        """The message of an answer on ``cmdexe``."""
        origin = self._origin(_ANSWERS, at)
        topic = names.answer_topic(self._apikey, self._id)
        return LaneMessage(topic, codec.write_answer(replace(answer, origin=origin)))

    def goal_answer(self, answer: GoalAnswer, at: Instant) -> LaneMessage:
        """The message of a word on a goal on ``cmdexe``."""
        origin = self._origin(_GOALS, at)
        topic = names.answer_topic(self._apikey, self._id)
        payload = codec.write_goal_answer(replace(answer, origin=origin))
        return LaneMessage(topic, payload)

    def _send_single(
        self, single: SinglePayload, observation: Observation, at: Instant
    ) -> None:
        if isinstance(observation, LaserScan):
            single.scan = observation
        elif isinstance(observation, DetectionFrame):
            single.replace_frame(observation)
        elif isinstance(observation, Odometry):
            origin = self._origin("", at)
            payload = single.write(replace(observation, origin=origin))
            self._emit("", payload, at.mono)

    def _emit(
        self, suffix: str, payload: bytes, now: float, *, news: bool = False
    ) -> None:
        if self.rates.is_measure(suffix, now, news=news):
            self._enqueue(self._topic(suffix), payload)
        else:
            self._enqueue(names.direct_topic(self._id, suffix), payload)

    def _topic(self, suffix: str) -> str:
        return names.measure_topic(self._apikey, self._id + suffix)

    def _origin(self, suffix: str, at: Instant) -> Origin:
        self._next[suffix] += 1
        echo = self._echo
        return Origin(
            self._boot,
            self._next[suffix],
            _stamp_of(at.wall),
            at.wall,
            at.mono,
            acknowledgements=echo is not None,
            heard=None if echo is None else echo.heard,
            replay=self._replay,
        )


_stamp_of = lru_cache(maxsize=1)(codec.format_stamp)
"""Text of a wall-clock time, written once for simultaneous observations."""


def _seen(frame: DetectionFrame) -> tuple[tuple[str, int], ...]:
    """Classes of a frame with their confidence: below 0.5, below 0.8, above."""
    return tuple(
        sorted(
            (one.class_id, (one.probability >= 0.5) + (one.probability >= 0.8))
            for one in frame.detections
        )
    )


def _suffix_of(observation: Observation) -> str:
    """Of the device that the observation is a measure of."""
    kind = type(observation)
    if isinstance(observation, Unplaced):
        kind = _UNPLACED[observation.kind]
    return KIND_OF[kind].suffix or ""
