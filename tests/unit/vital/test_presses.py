"""One press is one STOP."""

import pytest

from iveg.domain.records import CommandRecord
from iveg.domain.stop import FollowedCommand, Press
from iveg.vital.command import REMEMBERED_S
from tests.builders import START
from tests.unit.vital.desk import Desk, settle


async def press(desk: Desk, by: str = "ana", **words: object) -> FollowedCommand:
    said = Press(**({"press_id": "p1"} | words))  # type: ignore[arg-type]
    (command,) = await desk.commander.stop(["AGI"], by, desk.clock(), said)
    await settle()
    return command


async def released(desk: Desk) -> None:
    """The robot stood and has reported the release."""
    await desk.stand()
    hold = desk.commander.machine("AGI").hold_id or ""
    await desk.commander.release("AGI", [hold], "ana", desk.clock())
    desk.report(released=(hold,))
    await settle()


async def test_the_same_press_on_both_transports_is_one_command() -> None:
    desk = Desk()

    first, second = await press(desk), await press(desk)

    assert first.command_id == second.command_id
    assert second.requesters == ("ana",)


async def test_a_copy_that_comes_after_the_release_stops_nothing() -> None:
    desk = Desk()
    first = await press(desk)
    await released(desk)
    lines = len(desk.journal.lines)

    again = await press(desk)

    assert again.command_id == first.command_id
    assert not desk.commander.machine("AGI").wants_stop
    assert len(desk.journal.lines) == lines


@pytest.mark.parametrize(
    ("by", "press_id", "later_s"),
    [("ana", "p2", 0.0), ("ben", "p1", 0.0), ("ana", "p1", REMEMBERED_S + 0.1)],
    ids=["another name", "another person", "the same name after a minute"],
)
async def test_another_press_after_the_release_stops_again(
    by: str, press_id: str, later_s: float
) -> None:
    desk = Desk()
    first = await press(desk)
    await released(desk)
    desk.clock.now += later_s

    again = await press(desk, by, press_id=press_id)

    assert again is not first
    assert desk.commander.machine("AGI").wants_stop


@pytest.mark.parametrize(
    ("before_s", "believed"),
    [(0.18, True), (59.9, True), (60.1, False), (-0.2, True), (-0.3, False)],
)
async def test_a_press_is_dated_by_the_page_within_reason(
    before_s: float, believed: bool
) -> None:
    desk = Desk()

    times = (await press(desk, pressed_at=START.wall - before_s)).times

    assert (times.pressed is not None) == believed
    assert times.pressed is None or times.pressed <= times.requested.wall


async def test_standstill_counts_from_the_finger_and_the_history_knows_it() -> None:
    desk = Desk()
    command = await press(desk, pressed_at=START.wall - 0.5)

    await desk.stand()

    assert desk.now(command).standstill_ms == pytest.approx(500.0, abs=1.0)
    newest = desk.records(CommandRecord)[-1]
    assert newest.pressed_at == pytest.approx(START.wall - 0.5)
