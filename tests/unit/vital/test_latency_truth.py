"""Delays that a radio and an agent put in are found in the right hop.

Robots, their uplink, the codec and all of iVeg are real; time is moved by hand, so that
what was put in is known to the microsecond.
"""

import heapq
from itertools import count

import pytest

from iveg.domain.latency import Segment, Sketch, merged
from iveg.domain.observations import Instant, Received
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from iveg.ngsi import codec
from tests.builders import START
from tests.stage import Stage

CALM_AGENT_S = 0.015


class Air(Stage):
    """A stage whose messages take their time: radio to the broker, agent to Orion.

    Attributes:
        late_s: Delay of AGI's radio, which keeps the order; AGII's is well.
        agent_s: From the broker to Orion.
    """

    def __init__(self, late_s: float = 0.0, agent_s: float = CALM_AGENT_S) -> None:
        self.late_s, self.agent_s = late_s, agent_s
        self._newest_due = 0.0
        self._on_way: list[tuple[float, int, TransportId, str, bytes]] = []
        self._numbers = count()
        # Robots speak as soon as they are made.
        super().__init__("viewpoints")

    async def step(self) -> None:
        """What is due by the end of a step arrives in it, each at its own moment."""
        end = self.now.mono + 0.05
        while self._on_way and self._on_way[0][0] <= end:
            due, _, transport, device, payload = heapq.heappop(self._on_way)
            at = Instant(due, START.wall + due - START.mono)
            for observation in codec.read_measure(device, payload).observations:
                self.desk.ingest.enqueue(Received(observation, at, transport))
        await super().step()

    def _hear(self, topic: str, payload: bytes) -> None:
        now, device = self.now.mono, topic.split("/")[2]
        due = now
        if device.startswith("AGI_"):
            due = self._newest_due = max(self._newest_due, now + self.late_s)
        transports: tuple[tuple[TransportId, float], ...] = (
            (DIRECT.id, due),
            (FIWARE.id, due + self.agent_s),
        )
        for transport, when in transports:
            number = next(self._numbers)
            heapq.heappush(self._on_way, (when, number, transport, device, payload))

    def took(self, robot_id: str, hop: Segment) -> Sketch:
        """What a hop took for a robot's odometry in the last minute."""
        streams = self.desk.latency.streams.values()
        one = next(s for s in streams if (s.robot_id, s.data) == (robot_id, "odometry"))
        return merged(one.segments[hop].parts())


async def play(air: Air, seconds: float) -> None:
    for _ in range(round(20 * seconds)):
        await air.step()


def close(seconds: float) -> object:
    """Within 10 ms or 10 %, the larger."""
    return pytest.approx(seconds, abs=0.010, rel=0.10)


@pytest.mark.parametrize(
    ("late_s", "agent_s"),
    [(0.050, CALM_AGENT_S), (0.0, CALM_AGENT_S + 0.120)],
    ids=["radio", "agent"],
)
async def test_a_delay_is_found_in_the_hop_that_has_it_and_in_no_other(
    late_s: float, agent_s: float
) -> None:
    air = Air(late_s, agent_s)

    await play(air, 12.0)

    found = {hop: air.took("AGI", hop) for hop in ("uplink", "fiware", "robot_orion")}
    assert found["uplink"].count > 200
    assert {hop: one.mean for hop, one in found.items()} == {
        "uplink": close(late_s),
        "fiware": close(agent_s),
        "robot_orion": close(late_s + agent_s),
    }
    assert air.took("AGII", "uplink").mean == close(0.0)


async def test_a_delay_that_begins_later_is_not_taken_for_a_clock_that_was_set() -> (
    None
):
    air = Air()
    await play(air, 5.0)

    air.late_s = 0.400
    await play(air, 15.0)

    clock = air.desk.latency.clocks["AGI"]
    assert (clock.state, clock.offset_s) == ("in_step", 0.0)
    assert air.took("AGI", "uplink").quantile(0.95) == close(0.400)
