"""Robot, broker, FIWARE, iVeg and a page, each with a delay, on a clock of its own."""

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count

from iveg.domain.latency import DATA, Data, LatencyWatch, Segment, Sketch, merged
from iveg.domain.observations import FeedbackRef, Observation, Origin, Received
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from iveg.domain.world import FeedbackLedger
from tests.builders import START, at, detection_frame, odometry, scan

Delay = Callable[[], float]
HZ = 20
MAKE: dict[Data, Callable[[str, Origin], Observation]] = {
    "odometry": lambda robot_id, origin: odometry(robot_id, origin=origin),
    "detections": lambda robot_id, origin: detection_frame(robot_id, origin=origin),
    "lidar": lambda robot_id, origin: scan(robot_id, origin=origin),
}


def still(seconds: float) -> Delay:
    return lambda: seconds


def as_it_is(origin: Origin) -> Origin:
    return origin


@dataclass
class Chain:
    """Twenty messages a second of each kind.

    Attributes:
        up: What a message takes to the broker (s); ``agent`` on to Orion; ``iveg`` to
            the decision; ``page`` to the screen.
        written: What becomes of an origin before it is sent.
        direct: Whether iVeg reads the broker itself.
    """

    up: Delay = field(default=still(0.004))
    agent: Delay = field(default=still(0.020))
    iveg: Delay = field(default=still(0.001))
    page: Delay = field(default=still(0.010))
    written: Callable[[Origin], Origin] = as_it_is
    direct: bool = True
    watch: LatencyWatch = field(init=False)
    now: float = 0.0

    def __post_init__(self) -> None:
        self._ledger = FeedbackLedger()
        self.watch = LatencyWatch(("AGI",), self._ledger.composed_at)
        self._rounds = 0
        self._numbers = count()
        self._last: dict[TransportId, Received] = {}
        self._waiting: list[tuple[float, int, Callable[[], None]]] = []

    def run(self, seconds: float) -> None:
        """Let it go on for this long."""
        for _ in range(round(HZ * seconds)):
            self._rounds += 1
            self.now = self._rounds / HZ
            first = self._rounds
            self._ledger.composed("iveg", first, first, START.mono + self.now - 0.01)
            for data in DATA:
                self._send(data)
            while self._waiting and self._waiting[0][0] <= self.now:
                heapq.heappop(self._waiting)[2]()
            self.watch.tick(at(self.now))

    def took(self, hop: Segment, data: Data = "odometry") -> Sketch:
        """The last minute of a hop."""
        (stream,) = (one for one in self.watch.streams if one.data == data)
        return merged(stream.segments[hop].parts("1min"))

    def last(self, transport: TransportId) -> Received:
        """What came last on a transport."""
        return self._last[transport]

    def _send(self, data: Data) -> None:
        seq, stamp = self._rounds, round(START.wall + self.now, 3)
        heard = FeedbackRef("iveg", self._rounds)
        sent = self.written(Origin("b", seq, str(stamp), stamp, self.now, True, heard))
        told = MAKE[data]("AGI", sent)
        broker = self.now + self.up()
        if self.direct:
            self._later(broker, lambda: self._arrive(told, broker, DIRECT.id, data))
        orion = broker + self.agent()
        self._later(orion, lambda: self._arrive(told, orion, FIWARE.id, data))

    def _arrive(
        self, told: Observation, when: float, transport: TransportId, data: Data
    ) -> None:
        received = Received(told, at(when), transport)
        self.watch.arrived(received)
        self._last[transport] = received
        if transport == "direct" or not self.direct:
            decided = when + self.iveg()
            self._later(decided, lambda: self._decide(received, decided, data))

    def _decide(self, received: Received, when: float, data: Data) -> None:
        self.watch.decided([received], at(when))
        robot_id = received.observation.robot_id
        painted = when + self.page()
        self._later(
            painted,
            lambda: self.watch.painted(robot_id, data, at(when).mono, at(painted).mono),
        )

    def _later(self, when: float, what: Callable[[], None]) -> None:
        heapq.heappush(self._waiting, (when, next(self._numbers), what))
