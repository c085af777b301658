"""Input of the direct transport: robots' messages, read from MQTT without FIWARE.

All of it also comes through Orion; whichever copy is first counts.  The agent drops a
whole message for one apostrophe and falls seconds behind under load (docs/fiware.md),
and neither people nor poses must vanish for that.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

from iveg.domain.kinds import KIND_OF, KINDS, Kind, Scope
from iveg.domain.observations import (
    Instant,
    Observation,
    Received,
    kind_of,
)
from iveg.domain.transports import DIRECT
from iveg.ngsi import codec, names

Recorded = Callable[[str, bytes, Instant], None]
_WIDER: Sequence[Scope] = ("off", "safety", "all")


def _read_in(scope: Scope) -> tuple[Kind, ...]:
    """Kinds that are read directly in a scope."""
    within = _WIDER[1 : _WIDER.index(scope) + 1]
    return tuple(kind for kind in KINDS if kind.direct in within)


@dataclass(frozen=True, slots=True)
class _Source:
    """Topic of a robot, and the reader of its messages.

    Attributes:
        read: Reads a payload.
        kind: Kind of all its messages; None: they are of several.
        sparse: Its topic has two safety reports a second; see ``Received``.
    """

    robot_id: str
    qos: int
    read: Callable[[bytes], codec.ReadResult]
    kind: type[Observation] | None = None
    sparse: bool = True


class Intake(Protocol):
    """Takes what is read."""

    def is_early(self, robot_id: str, kind: type[Observation], now: float) -> bool:
        """Whether a message comes too soon after one of its kind to be read."""

    def enqueue(self, received: Received) -> None:
        """Take an observation."""

    def reject(self, source: str, reason: str, detail: str = "") -> None:
        """Count what cannot be used."""


class DirectReader:
    """Turns messages of robots into observations of the ``direct`` transport.

    Args:
        intake: Where observations go and the unreadable is counted.
        scope: What is read; ``safety`` leaves poses, scans and intent to FIWARE.
        recorded: Told of each message that is read: topic, payload, and when.
    """

    def __init__(
        self,
        apikey: str,
        robots: Iterable[str],
        clock: Callable[[], Instant],
        intake: Intake,
        scope: Scope = "all",
        recorded: Recorded | None = None,
    ) -> None:
        self._clock, self._intake, self._recorded = clock, intake, recorded
        kinds = _read_in(scope)
        self._kinds = tuple(kind.of for kind in kinds)
        self._sources = {
            topic: source
            for robot_id in robots
            for topic, source in self._of_robot(apikey, robot_id, kinds)
        }

    def _of_robot(
        self, apikey: str, robot_id: str, kinds: Iterable[Kind]
    ) -> Iterator[tuple[str, _Source]]:
        """Topics of one robot."""
        for kind in kinds:
            if kind.suffix is None:
                continue
            name = robot_id + kind.suffix
            read = partial(codec.read_measure, name)
            source = _Source(robot_id, kind.qos, read, kind.of)
            yield names.measure_topic(apikey, name), source
            if kind.speaks_alone:
                alone = names.direct_topic(robot_id, kind.suffix)
                yield alone, replace(source, sparse=False)
        if kinds:
            whole = partial(codec.read_measure, robot_id)
            yield names.measure_topic(apikey, robot_id), _Source(robot_id, 1, whole)
            answer = partial(codec.read_answer, robot_id)
            yield names.answer_topic(apikey, robot_id), _Source(robot_id, 1, answer)

    def subscriptions(self) -> list[dict[str, int]]:
        """Topics and their QoS, apart for each robot and kind that is sent often."""
        found: dict[object, dict[str, int]] = {}
        for topic, source in self._sources.items():
            is_often = source.kind is not None and KIND_OF[source.kind].speaks_alone
            stream = source.robot_id, source.kind if is_often else None
            found.setdefault(stream, {})[topic] = source.qos
        return [*found.values()]

    def refuse_stored(self, topic: str, _: bytes) -> None:
        """Count a message that the broker had retained: nobody knows how old it is."""
        source = self._sources.get(topic)
        if source is not None:
            self._intake.reject(source.robot_id, "retained", topic)

    def read(self, topic: str, payload: bytes) -> None:
        """Take one message."""
        source = self._sources.get(topic)
        if source is None:
            return
        at = self._clock()
        kind = source.kind
        if kind is not None and self._intake.is_early(source.robot_id, kind, at.mono):
            return
        if self._recorded is not None:
            self._recorded(topic, payload, at)
        reading = source.read(payload)
        for problem in reading.problems:
            self._intake.reject(problem.source, problem.reason, problem.detail)
        for observation in reading.observations:
            if issubclass(kind_of(observation), self._kinds):
                self._intake.enqueue(
                    Received(observation, at, DIRECT.id, sparse=source.sparse)
                )
