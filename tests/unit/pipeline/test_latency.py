"""The latency watch in the loop: copies timed, minutes kept, overload in the log."""

from dataclasses import replace

import pytest

from iveg.domain.latency.segments import Segment
from iveg.domain.latency.sketch import Sketch, merged
from iveg.domain.observations import Received
from iveg.domain.records import LatencyRecord
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from iveg.pipeline.latency import hours_of
from iveg.web.pages.translations import read_translations
from tests.builders import odometry
from tests.unit.pipeline.desk import Desk


def say(desk: Desk, *transports: TransportId, after_s: float = 0.0) -> None:
    """One odometry of AGI, on each of the transports, the second so much later."""
    told = odometry("AGI", origin=desk.next_origin())
    for number, transport in enumerate(transports):
        desk.clock.now += after_s if number else 0.0
        desk.ingest.enqueue(Received(told, desk.clock(), transport))
        desk.loop.step(desk.ingest.drain(), desk.clock())


def took(desk: Desk, hop: Segment) -> Sketch:
    stream = desk.latency.watch.streams[0]
    return merged(stream.segments[hop].parts("1min"))


def test_both_copies_of_a_message_are_timed_and_it_is_decided_on_once() -> None:
    desk = Desk()

    say(desk, DIRECT.id, FIWARE.id, after_s=0.120)

    assert took(desk, "fiware").mean == pytest.approx(0.120)
    assert took(desk, "robot_orion").mean == pytest.approx(0.120)
    assert took(desk, "iveg").count == 1


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


async def test_a_minute_goes_to_the_history_and_comes_back_from_it() -> None:
    desk = Desk()
    for _ in range(8):
        say(desk, DIRECT.id, FIWARE.id, after_s=0.020)
        await desk.wait(10.0)

    kept = desk.records(LatencyRecord)
    later = Desk()
    later.latency.watch.remember(hours_of(kept))

    assert {one.hop for one in kept} == {"uplink", "fiware", "robot_orion", "iveg"}
    day = later.latency.watch.streams[0].segments["fiware"].parts("24h")
    assert merged(day).mean == pytest.approx(0.020)


def test_rows_of_a_later_version_and_broken_ones_are_left_alone() -> None:
    row = LatencyRecord(
        at=0.0,
        robot_id="AGI",
        data="lidar",
        hop="uplink",
        count=1,
        total_s=0.1,
        least_s=0.1,
        most_s=0.1,
        bins="no bins",
    )

    assert hours_of([row, replace(row, hop="later")]) == []


async def test_an_agent_that_is_behind_is_told_in_the_log_once() -> None:
    desk = Desk()
    say(desk, DIRECT.id, FIWARE.id)
    for _ in range(40):
        say(desk, DIRECT.id)
        await desk.wait(0.1)

    assert desk.sentences().count("log.behind.fiware") == 1


@pytest.mark.parametrize("language", ["es", "en"])
@pytest.mark.parametrize("what", ["behind", "growing", "lost", "reordered"])
def test_every_remark_has_a_sentence_on_the_page_and_in_the_log(
    language: str, what: str
) -> None:
    hops = ["uplink", "fiware"]
    hops += ["iveg", "screen"] if what in ("behind", "growing") else []
    sentences = read_translations(language).sentences

    asked = {f"latency.{what}.{hop}" for hop in hops}
    asked |= {f"log.{what}.{hop}" for hop in hops if what != "growing"}

    assert asked <= sentences.keys()
