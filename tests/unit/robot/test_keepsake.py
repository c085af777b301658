"""What a robot keeps of a gap, and when it sends it."""

from math import inf

import orjson
import pytest

from iveg.domain.backfill import KEPT_S, MOST_BOXES, MOST_MESSAGES
from iveg.domain.observations import Instant
from iveg.ngsi import codec
from iveg.ngsi.codec.backfill import LARGEST
from iveg.robot.keepsake import CALM_S, HEARD_S, MOST_KEPT, Keepsake
from tests.builders import detection, detection_frame, hold, odometry, safety_report


def at(seconds: float) -> Instant:
    return Instant(seconds, 1_700_000_000.0 + seconds)


def drive(robot: Keepsake, since: int, until: int, heard_s: float) -> None:
    """Sense at 10 Hz, and look for a batch each second that is not sent."""
    for tick in range(since * 10, until * 10):
        now = at(tick / 10)
        robot.keep(odometry(x=tick / 10), now)
        robot.keep(safety_report(), now)
        if tick % 10 == 0:
            robot.next_batch(now, (), heard_s)


def sent(robot: Keepsake, since: float) -> list[float]:
    """Moments of everything that it sends from a moment on, a batch a second."""
    moments: list[float] = []
    now = since
    while (payload := robot.next_batch(at(now), (), 0.1)) is not None:
        assert len(payload) <= LARGEST
        batch, problems = codec.read_backfill("AGI", payload)
        assert problems == ()
        assert 0 < len(batch.kept) <= MOST_MESSAGES
        moments += [one.origin.mono or 0.0 for one in batch.kept]
        robot.went()
        now += 1.0
    return moments


def test_a_gap_is_sent_once_in_order_when_it_was_heard_for_a_while() -> None:
    robot = Keepsake("AGI", "boot-a")
    drive(robot, 0, 60, inf)
    drive(robot, 60, 64, 0.1)
    assert robot.next_batch(at(59 + HEARD_S - 0.1), (), 0.1) is None

    moments = sent(robot, 60.0 + HEARD_S)

    assert moments == sorted(moments)
    assert moments[0] == 0.0
    assert 59.0 <= moments[-1] <= 60.1
    assert len(moments) == pytest.approx(3 * 60, abs=6)
    assert robot.next_batch(at(200.0), (), 0.1) is None


def test_what_was_not_confirmed_is_sent_again() -> None:
    robot = Keepsake("AGI", "boot-a")
    drive(robot, 0, 10, inf)

    first = robot.next_batch(at(20.0), (), 0.1)
    again = robot.next_batch(at(21.0), (), 0.1)

    assert first is not None
    assert again is not None
    assert orjson.loads(first)["messages"] == orjson.loads(again)["messages"]


def test_while_it_is_heard_it_keeps_seconds_and_in_a_gap_ten_minutes() -> None:
    robot = Keepsake("AGI", "boot-a")
    drive(robot, 0, 3, inf)
    sent(robot, 10.0)
    drive(robot, 20, 40, 0.1)
    assert len(robot) <= 12

    drive(robot, 40, 900, inf)
    moments = sent(robot, 906.0)

    assert 906.0 - moments[0] <= KEPT_S + 30.0
    assert len(moments) <= MOST_KEPT


def test_a_change_of_holds_and_a_new_gap_interrupt() -> None:
    robot = Keepsake("AGI", "boot-a")
    drive(robot, 0, 60, inf)
    assert robot.next_batch(at(70.0), (), 0.1) is not None
    robot.went()

    assert robot.next_batch(at(71.0), (hold(),), 0.1) is None
    assert robot.next_batch(at(71.0 + CALM_S - 0.1), (hold(),), 0.1) is None
    assert robot.next_batch(at(71.0 + CALM_S), (hold(),), 0.1) is not None
    assert robot.next_batch(at(90.0), (hold(),), inf) is None
    assert robot.next_batch(at(90.0 + HEARD_S - 0.1), (hold(),), 0.1) is None
    assert robot.next_batch(at(90.0 + HEARD_S), (hold(),), 0.1) is not None


def test_of_a_full_picture_the_surest_boxes_are_kept_and_of_an_empty_one_nothing() -> (
    None
):
    robot = Keepsake("AGI", "boot-a")
    robot.keep(detection_frame("AGI"), at(0.0))
    assert len(robot) == 0
    many = [detection(probability=one / 100) for one in range(100)]
    robot.keep(detection_frame("AGI", *many), at(1.0))

    payload = robot.next_batch(at(10.0), (), 0.1)

    batch, _ = codec.read_backfill("AGI", payload or b"")
    (frame,) = batch.kept
    assert [one.probability for one in frame.detections] == [  # type: ignore[attr-defined]
        pytest.approx(1 - one / 100) for one in range(1, MOST_BOXES + 1)
    ]


def test_a_replay_keeps_nothing() -> None:
    robot = Keepsake("AGI", "boot-a", is_on=False)
    robot.keep(odometry(), at(0.0))
    assert len(robot) == 0
