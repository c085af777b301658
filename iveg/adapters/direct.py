"""Input of the direct transport: robots' messages, read from MQTT without FIWARE.

All of it also comes through Orion; whichever copy is first counts.  The agent drops a
whole message for one apostrophe and falls seconds behind under load (docs/fiware.md),
and neither people nor poses must vanish for that.
"""

from collections.abc import Callable, Iterable

from iveg.domain.observations import (
    DetectionFrame,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Received,
    SafetyReport,
    kind_of,
)
from iveg.domain.transports import DIRECT
from iveg.ngsi import codec, names
from iveg.ngsi.sensors import SENSORS
from iveg.pipeline.kinds import Scope, read_directly

_SUFFIXES: dict[type[Observation], str] = {
    Odometry: "_odom",
    LaserScan: "_lidar2D",
    DetectionFrame: "_yolox_bounding_boxes",
    SafetyReport: "_safety",
    Navigation: "_nav",
    **{sensor.of: sensor.suffix for sensor in SENSORS},
}

PassedOver = Callable[[str, type[Observation], int], None]


class DirectReader:
    """Turns messages of robots into observations of the ``direct`` transport.

    Args:
        offer: Where observations go; ``reject`` where the unreadable is counted.
        scope: What is read; ``safety`` leaves poses, scans and intent to FIWARE.
        is_past: Tells by its identity what FIWARE has already brought.
        passed_over: Told of a robot's messages of one kind that reached the broker and
            were not read, because a newer one was there.
    """

    def __init__(
        self,
        apikey: str,
        robots: Iterable[str],
        clock: Callable[[], Instant],
        offer: Callable[[Received], None],
        reject: Callable[[str, str, str], None],
        scope: Scope = "all",
        is_past: codec.IsPast | None = None,
        passed_over: PassedOver = lambda _robot, _kind, _count: None,
    ) -> None:
        self._clock = clock
        self._offer = offer
        self._reject = reject
        self._is_past = is_past
        self._passed_over = passed_over
        kinds = read_directly(scope)
        self._kinds = tuple(kinds)
        self._apart_s = {
            kind: row.apart_s for kind, row in kinds.items() if row.apart_s
        }
        self._due: dict[tuple[str, type[Observation]], float] = {}
        self._devices: dict[str, str] = {}
        self._sources: dict[str, tuple[str, type[Observation]]] = {}
        self._dense: set[str] = set()
        self._answers: dict[str, str] = {}
        self._subscriptions: dict[str, int] = {}
        for robot_id in robots:
            for kind, row in kinds.items():
                if kind in _SUFFIXES:
                    self._listen(apikey, robot_id, _SUFFIXES[kind], row.qos, kind)
            if kinds:
                self._listen(apikey, robot_id, "", 1)
                answers = names.answer_topic(apikey, robot_id)
                self._answers[answers] = robot_id
                self._subscriptions[answers] = 1

    def _listen(
        self,
        apikey: str,
        robot_id: str,
        suffix: str,
        qos: int,
        kind: type[Observation] | None = None,
    ) -> None:
        device = robot_id + suffix
        topics = [names.measure_topic(apikey, device)]
        if suffix in names.DIRECT_SUFFIXES:
            topics.append(names.direct_topic(robot_id, suffix))
            self._dense.add(topics[-1])
        for topic in topics:
            self._devices[topic] = device
            if kind is not None:
                self._sources[topic] = robot_id, kind
            self._subscriptions[topic] = qos

    def subscriptions(self) -> dict[str, int]:
        """Topics and their QoS."""
        return self._subscriptions

    def pass_over(self, topic: str, count: int) -> None:
        """So many messages of a topic came and were overtaken before they were read."""
        if topic in self._sources:
            self._passed_over(*self._sources[topic], count)

    def read(self, topic: str, payload: bytes) -> None:
        """Take one message."""
        at = self._clock()
        if self._is_early(topic, at.mono):
            self.pass_over(topic, 1)
            return
        if topic in self._devices:
            reading = codec.read_measure(self._devices[topic], payload, self._is_past)
        elif topic in self._answers:
            reading = codec.read_answer(self._answers[topic], payload)
        else:
            return
        for problem in reading.problems:
            self._reject(problem.source, problem.reason, problem.detail)
        for observation in reading.observations:
            if issubclass(kind_of(observation), self._kinds):
                sparse = topic not in self._dense
                self._offer(Received(observation, at, DIRECT.id, sparse=sparse))

    def _is_early(self, topic: str, now: float) -> bool:
        """Whether nobody would look at it: one of its kind has just been read."""
        source = self._sources.get(topic)
        if source is None or source[1] not in self._apart_s:
            return False
        if now < self._due.get(source, 0.0):
            return True
        self._due[source] = now + self._apart_s[source[1]]
        return False
