"""A third way to the robots is one entry of the table: nothing else is told of it."""

from iveg.domain.observations import CommandAnswer, Hold
from iveg.domain.records import CommandRecord
from iveg.domain.transports import FIWARE, Transport, TransportId
from iveg.models.command import Command as CommandModel
from tests.fakes.fleet import FakeFleet
from tests.fakes.records import NOON
from tests.unit.pipeline.desk import Desk, settle

DDS = Transport(TransportId("dds"), confirms=True)


async def stopped(desk: Desk) -> str:
    (command,) = await desk.commander.stop(["AGI"], "ana", desk.clock())
    await settle()
    return command.command_id


def told(desk: Desk, command_id: str) -> CommandModel:
    command = desk.commander.commands[command_id]
    return CommandModel.of(command, desk.commander.machine("AGI"), desk.clock())


async def test_a_stop_goes_over_the_third_transport_again_and_again() -> None:
    dds = FakeFleet()
    desk = Desk(also={DDS: dds})
    hold_id = await stopped(desk)

    await desk.wait(1.05)

    assert dds.stops == [("AGI", hold_id)] * 4
    assert len(desk.fleet.stops) == 4
    await desk.commander.close()


async def test_json_says_how_far_an_order_came_on_the_third_transport() -> None:
    desk = Desk(also={DDS: FakeFleet()})
    command_id = await stopped(desk)
    desk.hear(
        CommandAnswer("AGI", desk.next_origin(), command_id, "LATCHED"),
        TransportId("dds"),
    )

    told_now = told(desk, command_id)

    assert told_now.transports == {"direct": "ok", "fiware": "pending", "dds": "ok"}
    assert set(desk.commander.commands[command_id].times.answered) == {"dds"}
    await desk.commander.close()


async def test_times_and_the_row_of_the_history_are_keyed_by_the_third_transport() -> (
    None
):
    desk = Desk(also={DDS: FakeFleet()})
    command_id = await stopped(desk)
    desk.clock.now = 0.5
    desk.hear(
        CommandAnswer("AGI", desk.next_origin(), command_id, "LATCHED"),
        TransportId("dds"),
    )

    row = desk.records(CommandRecord)[-1]
    times = told(desk, command_id).times

    assert set(row.sent_at) == {"direct", "fiware", "dds"}
    assert row.answer_at == {"dds": NOON + 0.5}
    assert set(times.sent) == {"direct", "fiware", "dds"}
    assert times.answer == {"dds": "2023-11-14T22:13:20.500Z"}
    assert CommandModel.of_record(row).times == times
    await desk.commander.close()


async def test_a_release_goes_once_over_every_transport_that_can() -> None:
    dds = FakeFleet()
    deaf = FakeFleet()
    only_stops = Transport(TransportId("radio"), can_release=False)
    desk = Desk(also={DDS: dds, only_stops: deaf})
    hold_id = await stopped(desk)
    await desk.stand()

    order = await desk.commander.release("AGI", [hold_id], "ana", desk.clock())
    await settle()

    assert dds.asked == [("release", "AGI", (hold_id,))]
    assert deaf.asked == []
    assert deaf.stops
    assert desk.now(order).transports[TransportId("radio")] == "off"
    await desk.commander.close()


async def test_a_pose_by_the_third_transport_counts_as_direct_and_is_named() -> None:
    desk = Desk(also={DDS: FakeFleet()})
    desk.report("AGI", Hold("boot-b1", "boot", "remote"))
    desk.drive("AGI", 1.0)
    desk.clock.now = 0.1

    feed = desk.world.feeds.of("AGI")
    feed.heard(TransportId("dds"), desk.clock().mono, news=True)

    assert feed.transport(desk.clock().mono) == "dds"
    assert feed.transport(desk.clock().mono) != FIWARE.id
