"""A third way to the robots is one entry of the table: nothing else is told of it."""

from iveg.domain.transports import Transport, TransportId
from iveg.models.command import Command as CommandModel
from tests.fakes.fleet import FakeFleet
from tests.unit.vital.desk import Desk, settle

DDS = Transport(TransportId("dds"), confirms=True)


async def stopped(desk: Desk) -> str:
    (command,) = await desk.commander.stop(["AGI"], "ana", desk.clock())
    await settle()
    return command.command_id


def told(desk: Desk, command_id: str) -> CommandModel:
    command = desk.commander.commands[command_id]
    return CommandModel.of(command, desk.commander.machine("AGI"), desk.clock())


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
