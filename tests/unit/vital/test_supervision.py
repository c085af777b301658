"""Comfort may fail: it is named, comes back, and nothing vital notices."""

import asyncio
from dataclasses import replace

import pytest

from iveg.domain.observations import LaserScan, Received
from iveg.vital.supervision import Supervision
from tests.builders import odometry, scan
from tests.fakes.clock import FakeClock
from tests.unit.vital.desk import Desk, conditions_of


class BrokenError(Exception):
    """What a part of a test fails with."""


def breaks(*_: object) -> None:
    raise BrokenError


def said(supervision: Supervision, clock: FakeClock) -> list[tuple[str, str, object]]:
    return [
        (one.priority, one.key, one.slots["part"])
        for one in supervision.conditions(clock())
    ]


def test_f61_a_guarded_call_that_fails_is_counted_and_named_until_it_is_well(
    caplog: pytest.LogCaptureFixture,
) -> None:
    clock = FakeClock()
    supervision = Supervision(clock)
    supervision.listen("costmap", aged=breaks)

    for _ in range(3):
        supervision.tell("aged", clock())
    clock.now = 5.0
    while_failing = said(supervision, clock)
    clock.now = 11.0

    assert supervision.counters["comfort_failed.costmap"] == 3
    assert while_failing == [("P3", "alert.part_down", "costmap")]
    assert said(supervision, clock) == []
    assert len(caplog.records) == 1


def test_f63_a_long_turn_is_a_p2_for_a_while_and_a_short_one_is_none() -> None:
    clock = FakeClock()
    supervision = Supervision(clock)
    supervision.note_turn(0.20)
    before = list(supervision.conditions(clock()))
    supervision.note_turn(0.31)
    (found,) = supervision.conditions(clock())
    clock.now = 200.0

    assert before == []
    assert (found.priority, found.key) == ("P2", "alert.loop_held_up")
    assert found.slots == {"ms": 310}
    assert supervision.counters["long_turn"] == 1
    assert list(supervision.conditions(clock())) == []


async def test_f61_a_history_that_fails_holds_up_neither_stop_nor_feedback(
    caplog: pytest.LogCaptureFixture,
) -> None:
    desk = Desk()
    desk.sink.mistake = BrokenError()

    desk.drive("AGI")
    desk.look("AGI")
    told = len(desk.fleet.told)
    async with asyncio.timeout(30):
        (command,) = await desk.commander.stop(["AGI"], "ana", desk.clock())
    await desk.wait(1.0)

    assert ("AGI", command.hold_id) in desk.fleet.stops
    assert len(desk.fleet.told) >= told + 2 * 8
    assert "alert.part_down" in conditions_of(desk)
    assert [one.levelname for one in caplog.records] == ["ERROR"]


def broken_scan() -> LaserScan:
    """Its identity cannot be compared, which no reader lets through today."""
    good = scan()
    origin = replace(good.origin, stamp_s="noon", seq="one")  # type: ignore[arg-type]
    return replace(good, origin=origin)


def test_f60_what_only_comfort_reads_is_refused_where_it_fails() -> None:
    desk = Desk()
    desk.drive("AGI")
    good = replace(scan(), origin=desk.next_origin())
    desk.hear(good)

    later = Received(broken_scan(), desk.clock())
    desk.loop.step([later, Received(odometry("AGII", 5.0), desk.clock())], desk.clock())

    assert desk.world.robot("AGII").odometry is not None
    assert desk.ingest.counters["rejected.unusable_LaserScan"] == 1


def test_what_a_limit_rests_on_is_not_dropped_in_silence() -> None:
    desk = Desk()
    desk.drive("AGI")
    bad = replace(odometry(), origin=broken_scan().origin)

    with pytest.raises(TypeError):
        desk.loop.step([Received(bad, desk.clock())], desk.clock())


def test_f62_the_last_feedback_limits_every_robot_to_half_speed() -> None:
    desk = Desk()
    desk.drive("AGI")
    desk.drive("AGII", 50.0)

    desk.evaluator.leave_unsupervised(desk.clock())

    limits = desk.fleet.told[-1].speed_limits
    assert set(limits) == {"AGI", "AGII"}
    assert {one.speed_factor for one in limits.values()} == {0.5}
    assert {one.reason for one in limits.values()} == {"unsupervised"}
