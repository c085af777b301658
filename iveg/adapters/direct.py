"""Input of the direct transport: robots' messages, read from MQTT without FIWARE.

Each message also comes through Orion; the first copy counts.  The agent drops a whole
message for one apostrophe and falls seconds behind under load (docs/fiware.md).
Neither people nor poses may vanish for that.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from iveg.domain.kinds import KIND_OF, KINDS, Kind, Scope
from iveg.domain.observations import (
    Instant,
    Observation,
    Received,
    kind_of,
)
from iveg.domain.transports import DIRECT
from iveg.ngsi import codec, names
from iveg.vital.ingest import Ingest

Recorded = Callable[[str, bytes, Instant], None]
_SCOPES: Sequence[Scope] = ("off", "safety", "all")
"""Narrowest first; each holds the kinds of those before it."""


@dataclass(frozen=True, slots=True)
class _Source:
    """Topic of a robot, and the reader of its messages.

    Attributes:
        read: Reads a payload.
        kind: Kind of all its messages; None: several kinds.
        sparse: Its topic carries two safety reports a second; see ``Received``.
    """

    robot_id: str
    qos: int
    read: Callable[[bytes], codec.ReadResult]
    kind: type[Observation] | None = None
    sparse: bool = True


class DirectReader:
    """Turns messages of robots into observations of the ``direct`` transport.

    Args:
        ingest: Takes observations, and counts what cannot be read.
        scope: Kinds that are read; ``safety`` leaves poses, scans and intent to FIWARE.
        recorded: Called with topic, payload and time of each message that is read.
    """

    def __init__(
        self,
        apikey: str,
        robots: Iterable[str],
        clock: Callable[[], Instant],
        ingest: Ingest,
        scope: Scope,
        recorded: Recorded,
    ) -> None:
        self._clock, self._ingest, self._recorded = clock, ingest, recorded
        scopes = _SCOPES[1 : _SCOPES.index(scope) + 1]
        kinds = [kind for kind in KINDS if kind.direct in scopes]
        self._kinds = tuple(kind.type_ for kind in kinds)
        self._sources = {
            topic: source
            for robot_id in robots
            for topic, source in self._sources_of(apikey, robot_id, kinds)
        }

    def _sources_of(
        self, apikey: str, robot_id: str, kinds: Iterable[Kind]
    ) -> Iterator[tuple[str, _Source]]:
        """Topics of one robot, with their sources."""
        for kind in kinds:
            if kind.suffix is None:
                continue
            name = robot_id + kind.suffix
            read = partial(codec.read_measure, name)
            source = _Source(robot_id, kind.qos, read, kind.type_)
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
        """Topics and their QoS, in groups: one for each frequent kind of a robot."""
        streams: dict[object, dict[str, int]] = {}
        for topic, source in self._sources.items():
            is_often = source.kind is not None and KIND_OF[source.kind].speaks_alone
            stream = source.robot_id, source.kind if is_often else None
            streams.setdefault(stream, {})[topic] = source.qos
        return [*streams.values()]

    def refuse_stored(self, topic: str, _: bytes) -> None:
        """Count a message that the broker had retained: its age is unknown."""
        source = self._sources.get(topic)
        if source is not None:
            self._ingest.reject(source.robot_id, "retained", topic)

    def read(self, topic: str, payload: bytes) -> None:
        """Decode a message, and hand its observations to the ingest."""
        source = self._sources.get(topic)
        if source is None:
            return
        at = self._clock()
        kind = source.kind
        # Before it is decoded: a flood of one kind costs the loop no JSON.
        if kind is not None and self._ingest.is_early(source.robot_id, kind, at.mono):
            return
        self._recorded(topic, payload, at)
        reading = source.read(payload)
        for problem in reading.problems:
            self._ingest.reject(problem.source, problem.reason, problem.detail)
        for observation in reading.observations:
            # The robot's own topic also carries kinds that the scope leaves to FIWARE.
            if issubclass(kind_of(observation), self._kinds):
                self._ingest.enqueue(
                    Received(observation, at, DIRECT.id, sparse=source.sparse)
                )
