"""The direct road in: what people's safety needs, read from MQTT without FIWARE.

Detections, safety reports and answers also come through Orion; whichever is first
counts.  The agent drops a whole message for one apostrophe and falls seconds behind
under load (fiware.md), and a person must not vanish for that.
"""

from collections.abc import Callable, Iterable

from iveg.domain.observations import (
    DetectionFrame,
    Instant,
    Observation,
    Received,
    SafetyReport,
)
from iveg.ngsi import codec, names

_READ = (DetectionFrame, SafetyReport)


class DirectReader:
    """Turns messages of robots into observations on the ``mqtt`` road.

    Args:
        offer: Where observations go; ``reject`` where the unreadable is counted.
    """

    def __init__(
        self,
        apikey: str,
        robots: Iterable[str],
        clock: Callable[[], Instant],
        offer: Callable[[Received], None],
        reject: Callable[[str, str, str], None],
    ) -> None:
        self._clock = clock
        self._offer = offer
        self._reject = reject
        self._devices: dict[str, str] = {}
        self._answers: dict[str, str] = {}
        for robot_id in robots:
            for suffix in ("", "_safety", "_yolox_bounding_boxes"):
                device = robot_id + suffix
                self._devices[names.measure_topic(apikey, device)] = device
            self._answers[names.answer_topic(apikey, robot_id)] = robot_id

    def subscriptions(self) -> dict[str, int]:
        """Topics and their QoS."""
        return dict.fromkeys([*self._devices, *self._answers], 1)

    def read(self, topic: str, payload: bytes) -> None:
        """Take one message."""
        at = self._clock()
        if topic in self._devices:
            reading = codec.read_measure(self._devices[topic], payload)
        elif topic in self._answers:
            reading = codec.read_answer(self._answers[topic], payload)
        else:
            return
        for problem in reading.problems:
            self._reject(problem.source, problem.reason, problem.detail)
        for observation in reading.observations:
            if topic in self._answers or _counts(observation):
                self._offer(Received(observation, at, "mqtt"))


def _counts(observation: Observation) -> bool:
    return isinstance(observation, _READ)
