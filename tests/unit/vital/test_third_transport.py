"""A third way to the robots is one entry of the table: nothing else is told of it."""

from iveg.domain.transports import Transport, TransportId
from tests.fakes.fleet import FakeFleet
from tests.unit.vital.desk import Desk, settle

DDS = Transport(TransportId("dds"), confirms=True)


async def test_a_release_goes_once_over_every_transport_that_can() -> None:
    dds = FakeFleet()
    deaf = FakeFleet()
    only_stops = Transport(TransportId("radio"), can_release=False)
    desk = Desk(also={DDS: dds, only_stops: deaf})
    (command,) = await desk.commander.stop(["AGI"], "ana", desk.clock())
    await settle()
    await desk.stand()
    hold_id = command.command_id

    order = await desk.commander.release("AGI", [hold_id], "ana", desk.clock())
    await settle()

    assert dds.asked == [("release", "AGI", (hold_id,))]
    assert deaf.asked == []
    assert deaf.stops
    assert desk.now(order).transports[TransportId("radio")] == "off"
    await desk.commander.close()
