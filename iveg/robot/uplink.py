"""Algorithm 1: what the robot's sensors say, on its way to iVeg.

Every observation gets its origin here (boot, count of its topic, the robot's clock) and
becomes a measure.  Telemetry goes at QoS 0 and only the newest of a topic waits; what
the broker could not take is not sent later, because by then it is no longer true.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from iveg.domain.observations import (
    CommandAnswer,
    DetectionFrame,
    Instant,
    LaserScan,
    Navigation,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.ngsi import codec, names
from iveg.robot.echo import Echo
from iveg.robot.lane import Message
from iveg.robot.single import SinglePayload

Sensed = Odometry | LaserScan | DetectionFrame | Navigation
Form = Literal["per-topic", "single"]

_SUFFIX: dict[type, str] = {
    Odometry: "_odom",
    LaserScan: "_lidar2D",
    DetectionFrame: "_yolox_bounding_boxes",
    Navigation: "_nav",
}
_ANSWERS = "cmdexe"


class Uplink:
    """Turns observations into messages, each with its place in the count.

    Args:
        robot_id: This robot.
        apikey: First part of its topics.
        boot: Random text of this start.
        offer: Takes telemetry; the newest of a topic wins.
        form: One message a topic, or Algorithm 1's single payload.
        first_report: ``seq`` of the first safety report; random, so that a number from
            an earlier boot is not taken for one of this.
        echo: What was heard of iVeg; None proves no age, as recordings cannot.

    Moments are the robot's own: monotonic seconds since its boot, and its wall clock.
    """

    def __init__(
        self,
        robot_id: str,
        apikey: str,
        boot: str,
        offer: Callable[[str, bytes], None],
        *,
        form: Form = "per-topic",
        first_report: int = 1,
        echo: Echo | None = None,
    ) -> None:
        self._id = robot_id
        self._apikey = apikey
        self._boot = boot
        self._offer = offer
        self._echo = echo
        self._single = SinglePayload(robot_id) if form == "single" else None
        self._next: Counter[str] = Counter({"_safety": first_report - 1})
        self.sent: Counter[str] = Counter()
        """Messages made, by device suffix; the single payload's is empty."""

    def send(self, observation: Sensed, at: Instant) -> None:
        """Send what a sensor said at this moment."""
        if self._single is not None and not isinstance(observation, Navigation):
            self._send_single(self._single, observation, at)
            return
        suffix = _SUFFIX[type(observation)]
        stamped = replace(
            observation, robot_id=self._id, origin=self._origin(suffix, at)
        )
        self._emit(suffix, _written(stamped))

    def report(self, report: SafetyReport, at: Instant) -> tuple[int, Message]:
        """The message of a safety report, and the ``seq`` that it carries."""
        origin = self._origin("_safety", at)
        payload = codec.write_safety(replace(report, origin=origin))
        self.sent["_safety"] += 1
        return origin.seq or 0, Message(self._topic("_safety"), payload)

    def answer(self, answer: CommandAnswer, at: Instant) -> Message:
        """The message of an answer on ``cmdexe``."""
        origin = self._origin(_ANSWERS, at)
        self.sent[_ANSWERS] += 1
        topic = names.answer_topic(self._apikey, self._id)
        return Message(topic, codec.write_answer(replace(answer, origin=origin)))

    def _send_single(
        self, single: SinglePayload, observation: Sensed, at: Instant
    ) -> None:
        if isinstance(observation, LaserScan):
            single.scan = observation
        elif isinstance(observation, DetectionFrame):
            single.look(observation)
        elif isinstance(observation, Odometry):
            origin = self._origin("", at)
            self._emit("", single.write(replace(observation, origin=origin)))

    def _emit(self, suffix: str, payload: bytes) -> None:
        self.sent[suffix] += 1
        self._offer(self._topic(suffix), payload)

    def _topic(self, suffix: str) -> str:
        return names.measure_topic(self._apikey, self._id + suffix)

    def _origin(self, suffix: str, at: Instant) -> Origin:
        self._next[suffix] += 1
        echo = self._echo
        return Origin(
            self._boot,
            self._next[suffix],
            codec.format_stamp(at.wall),
            at.wall,
            at.mono,
            echoes=echo is not None,
            heard=None if echo is None else echo.heard,
        )


def _written(observation: Sensed) -> bytes:
    match observation:
        case Odometry():
            return codec.write_odometry(observation)
        case LaserScan():
            return codec.write_scan(observation)
        case DetectionFrame():
            return codec.write_detections(observation)
        case Navigation():
            return codec.write_navigation(observation)
