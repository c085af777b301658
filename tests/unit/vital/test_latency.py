"""The latency watch in the loop: copies are timed."""

import pytest

from iveg.domain.latency import Segment, Sketch, merged
from iveg.domain.observations import Received
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from tests.builders import odometry
from tests.unit.vital.desk import Desk


def say(desk: Desk, *transports: TransportId, after_s: float = 0.0) -> None:
    """One odometry of AGI, on each of the transports, the second so much later."""
    told = odometry("AGI", origin=desk.next_origin())
    for number, transport in enumerate(transports):
        desk.clock.now += after_s if number else 0.0
        desk.ingest.enqueue(Received(told, desk.clock(), transport))
        desk.loop.step(desk.ingest.drain(), desk.clock())


def took(desk: Desk, hop: Segment) -> Sketch:
    stream = desk.latency.streams[0]
    return merged(stream.segments[hop].parts())


def test_a_copy_that_comes_twice_counts_once() -> None:
    desk = Desk()
    told = odometry("AGI", origin=desk.next_origin())

    for way in (DIRECT.id, DIRECT.id, FIWARE.id, FIWARE.id):
        desk.ingest.enqueue(Received(told, desk.clock(), way))

    assert {hop: took(desk, hop).count for hop in ("uplink", "fiware")} == {
        "uplink": 1,
        "fiware": 1,
    }


def test_what_waits_for_the_loop_is_part_of_the_third_hop() -> None:
    desk = Desk()
    told = odometry("AGI", origin=desk.next_origin())

    desk.ingest.enqueue(Received(told, desk.clock(), DIRECT.id))
    desk.clock.now += 0.3
    desk.loop.step(desk.ingest.drain(), desk.clock())

    assert took(desk, "iveg").mean == pytest.approx(0.3)


def test_an_answer_to_a_question_is_no_message() -> None:
    desk = Desk()

    told = odometry("AGI", origin=desk.next_origin())
    desk.ingest.enqueue(Received(told, desk.clock(), FIWARE.id, asked=True))

    assert took(desk, "robot_orion").count == 0
