"""A third way to the robots is one entry of the table: nothing else is told of it."""

from iveg.domain.observations import CommandAnswer
from iveg.domain.records import CommandRecord
from iveg.domain.transports import Transport, TransportId
from iveg.models.command import Command as CommandModel
from tests.fakes.fleet import FakeFleet
from tests.fakes.records import NOON
from tests.unit.vital.desk import Desk, settle

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
    assert CommandModel.from_record(row).times == times
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
