"""The latency watch in the loop: copies are timed."""

import pytest

from iveg.domain.latency import Segment, Sketch, merged
from iveg.domain.observations import Received
from iveg.domain.transports import DIRECT, FIWARE
from tests.builders import odometry
from tests.unit.vital.desk import Desk


def took(desk: Desk, hop: Segment) -> Sketch:
    stream = next(iter(desk.latency.streams.values()))
    return merged(stream.segments[hop].parts())


def test_a_copy_that_comes_twice_counts_once_and_an_answer_not_at_all() -> None:
    desk = Desk()
    told = odometry("AGI", origin=desk.next_origin())
    desk.ingest.enqueue(Received(told, desk.clock(), FIWARE.id, is_query_answer=True))
    assert took(desk, "robot_orion").count == 0

    for way in (DIRECT.id, DIRECT.id, FIWARE.id, FIWARE.id):
        desk.ingest.enqueue(Received(told, desk.clock(), way))

    assert (took(desk, "uplink").count, took(desk, "fiware").count) == (1, 1)


def test_what_waits_for_the_loop_is_part_of_the_third_hop() -> None:
    desk = Desk()
    told = odometry("AGI", origin=desk.next_origin())

    desk.ingest.enqueue(Received(told, desk.clock(), DIRECT.id))
    desk.clock.now += 0.3
    desk.loop.step(desk.ingest.drain(), desk.clock())

    assert took(desk, "iveg").mean == pytest.approx(0.3)
