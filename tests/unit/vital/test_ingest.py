"""The door of the pipeline: bounded, and never at the cost of safety."""

from dataclasses import replace

import pytest

from iveg.domain.observations import (
    CommandAnswer,
    Observation,
    Origin,
    RefusedFrame,
)
from iveg.domain.transports import DIRECT
from iveg.domain.world import World
from iveg.vital.ingest import MOST_WAITING, Ingest
from tests.builders import (
    detection_frame,
    ignore,
    odometry,
    origin,
    received,
    safety_report,
    scan,
)


def ingest() -> Ingest:
    return Ingest(World(("AGI", "AGII")), ignore, ignore)


def test_of_one_robot_and_kind_the_newest_wait_and_the_others_are_counted() -> None:
    queue = ingest()
    for seq in range(MOST_WAITING + 10):
        queue.enqueue(received(odometry(x=float(seq))))

    left = [one.observation for one in queue.drain()]

    assert len(left) == MOST_WAITING
    assert left[0] == odometry(x=10.0)
    assert queue.counters["dropped.Odometry"] == 10


def test_f24_a_flood_of_one_kind_costs_no_other_kind_and_no_other_robot_anything() -> (
    None
):
    queue = ingest()
    answer = CommandAnswer("AGI", Origin(), "id", "LATCHED")
    precious: list[Observation] = [safety_report(), answer, detection_frame()]
    precious += [odometry("AGII"), detection_frame("AGII")]
    for one in precious:
        queue.enqueue(received(one))
    for seq in range(5000):
        queue.enqueue(received(scan(origin=origin(seq))))

    left = [one.observation for one in queue.drain()]

    assert left[:5] == precious
    assert len(left) == 5 + MOST_WAITING


def test_a_flood_of_frames_keeps_the_newest_and_says_that_others_were_not_read() -> (
    None
):
    queue = ingest()
    for seq in range(5000):
        queue.enqueue(received(detection_frame(origin=origin(seq))))

    assert queue.waiting == MOST_WAITING
    left = [one.observation for one in queue.drain()]
    assert left[-2:] == [detection_frame(origin=origin(4999)), RefusedFrame("AGI")]
    assert list(queue.drain()) == []


def test_an_unknown_robot_is_counted_each_time_and_logged_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    told: list[tuple[str, str]] = []
    queue = Ingest(World(("AGI",)), ignore, lambda *one: told.append(one))
    for _ in range(10):
        queue.enqueue(received(odometry("AGX")))

    assert list(queue.drain()) == []
    assert queue.counters["rejected.unknown_robot"] == 10
    assert told == [("AGX", "unknown_robot")]
    assert len(caplog.records) == 1


def test_what_was_asked_for_is_counted_apart_from_what_was_sent() -> None:
    queue = ingest()

    queue.enqueue(replace(received(odometry()), is_query_answer=True))
    queue.enqueue(received(odometry()))
    queue.enqueue(received(safety_report(), transport=DIRECT.id))

    counted = {"asked.Odometry": 1, "fiware.Odometry": 1, "direct.SafetyReport": 1}
    assert queue.counters == counted


def test_nobody_who_is_rejected_often_hides_the_rejection_of_another() -> None:
    told: list[tuple[str, str]] = []
    queue = Ingest(World(("AGI", "AGII")), ignore, lambda *one: told.append(one))
    for number in range(600):
        queue.reject(f"stranger-{number}", "bad_robot_id")
        queue.reject(f"AGI_{number}", "bad_robot_id")

    queue.reject("AGII_odom", "not_json")

    assert len(told) == 1001
    assert told[-1] == ("AGII_odom", "not_json")
