"""STOP over two transports, a disk and a restart, none of which waits for another."""

import asyncio

import pytest

from iveg.domain.errors import HopError
from iveg.domain.observations import Hold
from iveg.domain.records import CommandEventRecord, CommandRecord
from iveg.domain.stop import DesiredRecord, FollowedCommand
from iveg.domain.transports import DIRECT, FIWARE
from tests.fakes.records import command_record
from tests.unit.vital.desk import Desk, conditions_of, settle


async def press(desk: Desk, by: str = "ana") -> FollowedCommand:
    (command,) = await desk.commander.stop(["AGI"], by, desk.clock())
    await settle()
    return command


async def standing() -> tuple[Desk, str]:
    """A desk at which AGI was stopped and stands, and its hold."""
    desk = Desk()
    command = await press(desk)
    await desk.stand()
    return desk, command.command_id


async def release(desk: Desk, held: str) -> FollowedCommand:
    order = await desk.commander.release("AGI", [held], "ana", desk.clock())
    await settle()
    return order


async def test_i5_both_transports_have_it_before_the_disk_and_the_press_after() -> None:
    desk = Desk()
    desk.journal.opened.clear()

    pressing = asyncio.create_task(desk.commander.stop(["AGI"], "ana", desk.clock()))
    await settle()

    assert len(desk.fleet.stops) == 1
    assert len(desk.broker.asked) == 1
    assert not pressing.done()
    desk.journal.opened.set()
    (command,) = await pressing
    assert desk.journal.lines == [("AGI", "stopped", command.command_id, "ana")]


async def test_a_transport_that_hangs_does_not_hold_up_the_other() -> None:
    desk = Desk()
    desk.broker.opened.clear()

    command = await press(desk)
    await desk.wait(1.0)

    assert len(desk.fleet.stops) == 4
    assert desk.now(command).transports == {"direct": "ok", "fiware": "pending"}
    desk.broker.opened.set()
    await desk.commander.close()


@pytest.mark.parametrize(
    "failure", [HopError("orion", "away"), RuntimeError("nobody thought of this")]
)
async def test_a_transport_that_fails_is_shown_and_tried_again(
    failure: Exception,
) -> None:
    desk = Desk()
    desk.fleet.fails = True
    desk.broker.fails = failure

    command = await press(desk)
    await desk.wait(3.0)

    assert desk.now(command).transports == {"direct": "failed", "fiware": "failed"}
    assert len(desk.fleet.stops) == 8
    assert len(desk.broker.asked) == 2


async def test_f41_reports_with_an_old_number_do_not_keep_it_standing() -> None:
    desk, held = await standing()
    for _ in range(20):
        desk.seq = 3
        desk.report("AGI", Hold(held, "iveg", "remote"))
        await desk.wait(0.1)

    assert desk.commander.machine("AGI").state == "STALE"


@pytest.mark.parametrize(
    ("word", "key"),
    [(None, "alert.stop_unconfirmed"), ("LATCHED", "alert.stop_still_moving")],
)
async def test_a_stop_that_does_not_come_true_is_a_grave_alert(
    word: str | None, key: str
) -> None:
    desk = Desk()
    await press(desk)
    for said in filter(None, [word]):
        desk.answer(said)

    await desk.wait(6.0)

    assert key in conditions_of(desk)


async def test_a_held_robot_that_moves_is_a_grave_alert_until_it_stands_again() -> None:
    desk, _held = await standing()
    for _ in range(3):
        desk.drive("AGI", linear=0.4)
    await desk.wait(0.1)
    told = [one.condition for one in desk.evaluator.alerts.waiting]
    moved = [one for one in told if one.key == "alert.stop_moved"]
    assert [(one.priority, one.subject) for one in moved] == [("P1", "AGI")]

    desk.clock.now += 1.0
    await desk.stand()
    await desk.wait(0.1)

    (alert,) = (
        one
        for one in desk.evaluator.alerts.waiting
        if one.condition.key == "alert.stop_moved"
    )
    assert alert.cleared is not None


async def test_i6_a_release_goes_once_on_each_transport_and_names_its_attempt() -> None:
    desk, held = await standing()
    before = len(desk.fleet.stops)

    once = await release(desk, held)
    await desk.wait(1.9)

    order = ("release", "AGI", (held,))
    assert [one for one in desk.broker.asked if one[0] == "release"] == [order]
    assert desk.fleet.asked == [order]
    assert desk.fleet.orders == desk.broker.orders
    assert desk.fleet.orders[0][1] == once.command_id
    assert len(desk.fleet.stops) == before


async def test_a_transport_that_hangs_does_not_hold_up_a_release_on_the_other() -> None:
    desk, held = await standing()
    desk.broker.opened.clear()

    once = await release(desk, held)

    assert len(desk.fleet.asked) == 1
    assert desk.now(once).times.sent.get(DIRECT.id) is not None
    assert desk.now(once).transports == {"direct": "pending", "fiware": "pending"}
    await desk.commander.close()


async def test_13_7_an_order_was_sent_when_it_left_not_when_orion_says_so() -> None:
    desk = Desk()
    desk.broker.opened.clear()
    command = await press(desk)
    left = desk.clock()
    desk.clock.now += 0.4

    desk.broker.opened.set()
    await settle()

    assert desk.now(command).times.sent[FIWARE.id] == left
    await desk.commander.close()


async def test_the_journal_knows_what_a_release_names_before_it_goes_out() -> None:
    desk, held = await standing()
    desk.journal.opened.clear()

    await release(desk, held)
    waiting = list(desk.fleet.asked)
    desk.journal.opened.set()
    await settle()

    assert waiting == []
    assert len(desk.fleet.asked) == 1
    challenge = desk.fleet.orders[0][0]
    assert desk.journal.named_lines == [("AGI", held, (held,), challenge)]


async def test_orions_204_while_the_agent_is_cut_off_is_unknown() -> None:
    desk = Desk()
    desk.health_monitor.agent_error = "cannot be reached"
    desk.fleet.fails = True

    command = await press(desk)

    assert desk.now(command).transports == {"direct": "failed", "fiware": "unknown"}
    assert desk.now(command).state == "REQUESTED"


async def test_a_release_that_orion_does_not_take_is_not_sent_again() -> None:
    desk, held = await standing()
    desk.broker.refuse()

    await release(desk, held)
    await desk.wait(5.0)

    assert len([one for one in desk.broker.asked if one[0] == "release"]) == 1
    assert len(desk.fleet.asked) == 1


async def test_the_journal_says_run_only_after_the_robot_reported_the_release() -> None:
    desk, held = await standing()
    await release(desk, held)
    assert [line[1] for line in desk.journal.lines] == ["stopped"]

    desk.report("AGI", released=(held,))
    await settle()

    assert [line[1] for line in desk.journal.lines] == ["stopped", "run"]
    assert desk.fleet.levels[-1] == ("AGI", "run", ())


async def test_a_restart_asserts_a_hold_again_that_no_release_ever_named() -> None:
    desk = Desk()

    desk.commander.restore({"AGI": DesiredRecord("ana", "01HELD")}, desk.clock())
    await settle()

    machine = desk.commander.machine("AGI")
    assert machine.wants_stop
    assert desk.fleet.stops == [("AGI", "01HELD")]
    assert desk.journal.lines == [("AGI", "stopped", "01HELD", "ana")]
    assert desk.sentences() == ["log.stop.reasserted", "log.stop.sent"]
    assert machine.stop is not None
    assert machine.stop.command_id != "01HELD"


async def test_what_a_crash_left_open_is_closed_and_says_what_became_of_it() -> None:
    desk = Desk()
    desk.commander.restore({"AGI": DesiredRecord("ana")}, desk.clock())
    await settle()
    before = len(desk.sink.records)
    left = (
        command_record(command_id="01STOP", state="SENT"),
        command_record(command_id="01FREE", robot_id="AGII", state="READY"),
        command_record(command_id="01LIFT", kind="release", state="RELEASING"),
    )

    desk.commander.close_earlier(left, desk.clock())
    await settle()

    stop = desk.commander.machine("AGI").stop
    again = None if stop is None else stop.command_id
    new = desk.sink.durable[before:]
    events = [one for one in new if isinstance(one, CommandEventRecord)]
    rows = [one for one in new if isinstance(one, CommandRecord)]
    assert [(one.command_id, one.state, one.why) for one in events] == [
        ("01STOP", "REPLACED", f"server restarted; asserted again under {again}"),
        ("01FREE", "EXPIRED", "server restarted; followed no more"),
        ("01LIFT", "EXPIRED", "server restarted; followed no more"),
    ]
    assert [one.reason for one in rows] == ["restarted"] * 3


async def test_a_release_goes_out_when_its_audit_row_is_on_the_disk() -> None:
    desk, held = await standing()
    desk.sink.opened.clear()

    await release(desk, held)
    waiting = [what for what, _, _ in desk.broker.asked]
    desk.sink.opened.set()
    await settle()

    assert "release" not in waiting
    assert desk.broker.asked[-1][0] == "release"


async def test_a_release_that_the_disk_held_up_for_too_long_never_goes_out() -> None:
    desk, held = await standing()
    desk.sink.opened.clear()
    await release(desk, held)
    await desk.wait(2.1)

    desk.sink.opened.set()
    await settle()

    assert "release" not in [what for what, _, _ in desk.broker.asked]
    assert desk.commander.machine("AGI").wants_stop


async def test_a_hold_that_this_run_did_not_make_is_adopted_and_written_down() -> None:
    desk = Desk()

    desk.report("AGI", Hold("01BEFORE", "iveg", "remote"))
    await settle()

    assert desk.journal.lines == [("AGI", "stopped", "01BEFORE", "iveg")]
    assert desk.commander.machine("AGI").wants_stop


async def test_a_broker_that_is_back_gets_every_level_again() -> None:
    desk = Desk()
    command = await press(desk)
    desk.fleet.levels.clear()

    desk.commander.broker_back()
    await settle()

    assert desk.fleet.levels == [("AGI", "stopped", (command.command_id,))]


async def test_i9_each_step_is_one_row_of_the_audit() -> None:
    desk, held = await standing()
    await release(desk, held)
    desk.report("AGI", released=(held,))
    await settle()
    desk.report("AGI", factor=1.0, reason="clear", linear=0.3, released=(held,))

    steps = [
        one.state for one in desk.sink.records if isinstance(one, CommandEventRecord)
    ]
    stopped = ["REQUESTED", "SENT", "DELIVERED", "STANDING"]
    assert steps == [*stopped, "RELEASING", "READY", "RUNNING"]


async def test_f38_fifty_presses_are_fifty_rows_and_one_episode() -> None:
    desk = Desk()
    for number in range(50):
        await desk.commander.stop(["AGI"], f"operator-{number}", desk.clock())

    events = [one for one in desk.sink.records if isinstance(one, CommandEventRecord)]
    rows = [one for one in events if one.why != "sent"]
    assert [row.why for row in rows] == [
        "requested",
        *(f"joined by operator-{number}" for number in range(1, 50)),
    ]
    assert len({row.command_id for row in rows}) == 1
