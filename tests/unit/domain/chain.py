"""Robot, broker, FIWARE, iVeg and a page, each with a delay, on a clock of its own."""

import heapq
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count

from iveg.domain.age import FeedbackLedger
from iveg.domain.latency.segments import DATA, Data, Segment
from iveg.domain.latency.sketch import Sketch, merged
from iveg.domain.latency.stream import Stream
from iveg.domain.latency.watch import LatencyWatch
from iveg.domain.observations import FeedbackRef, Observation, Origin, Received
from iveg.domain.transports import DIRECT, FIWARE, TransportId
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


def jittered(least: float, most: float) -> Delay:
    chance = random.Random(5)  # noqa: S311 - jitter
    return lambda: chance.uniform(least, most)


def none_lost(_: int) -> bool:
    return False


def as_it_is(origin: Origin) -> Origin:
    return origin


@dataclass
class Chain:
    """Twenty messages a second of each kind.

    Attributes:
        up: What a message takes to the broker (s); ``agent`` on to Orion; ``iveg`` to
            the decision; ``page`` to the screen.
        lost_up: Whether the n-th is lost before the broker; ``lost_agent`` behind it.
        written: What becomes of an origin before it is sent.
        direct: Whether iVeg reads the broker itself; ``reading`` how long that takes.
    """

    up: Delay = field(default=still(0.004))
    agent: Delay = field(default=still(0.020))
    iveg: Delay = field(default=still(0.001))
    page: Delay = field(default=still(0.010))
    lost_up: Callable[[int], bool] = none_lost
    lost_agent: Callable[[int], bool] = none_lost
    written: Callable[[Origin], Origin] = as_it_is
    direct: bool = True
    thinned: bool = False
    reading: Delay = field(default=still(0.0))
    robots: tuple[str, ...] = ("AGI",)
    watch: LatencyWatch = field(init=False)
    now: float = 0.0

    def __post_init__(self) -> None:
        self._ledger = FeedbackLedger()
        self.watch = LatencyWatch(self.robots, self._ledger.composed_at)
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
            for robot_id in self.robots:
                for data in DATA:
                    self._send(robot_id, data)
            while self._waiting and self._waiting[0][0] <= self.now:
                heapq.heappop(self._waiting)[2]()
            self.watch.tick(at(self.now))

    def stream(self, data: Data = "odometry", robot_id: str = "AGI") -> Stream:
        streams = {(one.robot_id, one.data): one for one in self.watch.streams}
        return streams[robot_id, data]

    def took(
        self, hop: Segment, data: Data = "odometry", robot_id: str = "AGI"
    ) -> Sketch:
        """The last minute of a hop."""
        return merged(self.stream(data, robot_id).segments[hop].parts("1min"))

    def last(self, transport: TransportId) -> Received:
        """What came last on a transport."""
        return self._last[transport]

    def said(self) -> dict[str, dict[str, str | float]]:
        """What is wrong with the hops now, by its sentence."""
        remarks = self.watch.overloads.remarks
        return {one.key: dict(one.slots) for one in remarks}

    def _send(self, robot_id: str, data: Data) -> None:
        seq, stamp = self._rounds, round(START.wall + self.now, 3)
        heard = FeedbackRef("iveg", self._rounds)
        sent = self.written(Origin("b", seq, str(stamp), stamp, self.now, True, heard))
        told = MAKE[data](robot_id, sent)
        if self.lost_up(seq):
            return
        broker = self.now + self.up()
        if self.direct:
            read = broker + self.reading()
            self._later(read, lambda: self._arrive(told, read, DIRECT.id, data))
        if not self.lost_agent(seq):
            orion = broker + self.agent()
            self._later(orion, lambda: self._arrive(told, orion, FIWARE.id, data))

    def _arrive(
        self, told: Observation, when: float, transport: TransportId, data: Data
    ) -> None:
        received = Received(
            told, at(when), transport, thinned=self.thinned and transport == "fiware"
        )
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
