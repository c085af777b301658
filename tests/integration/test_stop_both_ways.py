"""A STOP on two real transports, one of which is slow, gone or overtaken (F7, F12)."""

import asyncio
import time

import pytest

from iveg.adapters.orion import OrionClient
from iveg.adapters.transports import OrionTransport
from iveg.domain.errors import HopError
from iveg.domain.transports import DIRECT
from tests.fakes.context_broker import FakeContextBroker
from tests.http_servers import Request, Response, http_server
from tests.unit.vital.desk import Desk, settle

TENANT = ("agroconnect", "/greenhouse")
ORION_SLOW_S = 5.0
GIVEN_UP_S = 1.5


async def slow(_: Request) -> Response:
    await asyncio.sleep(ORION_SLOW_S)
    return Response(204)


async def test_f7_a_slow_orion_is_given_up_after_a_second_and_a_half() -> None:
    async with (
        http_server(slow, "127.0.0.1", 0) as port,
        OrionClient(f"http://127.0.0.1:{port}", *TENANT) as orion,
    ):
        began = time.monotonic()
        with pytest.raises(HopError):
            await OrionTransport(orion).stop("AGI", "01HOLD", "x")
        took = time.monotonic() - began

    assert GIVEN_UP_S <= took < ORION_SLOW_S


@pytest.mark.parametrize("orion_hangs", [False, True])
async def test_f7_the_direct_transport_is_as_fast_while_orion_hangs(
    orion_hangs: bool,
) -> None:
    desk = Desk()
    if orion_hangs:
        desk.broker.opened.clear()

    await desk.commander.stop(["AGI"], "ana", desk.clock())
    await settle()

    command = desk.commander.machine("AGI").stop
    assert command is not None
    assert desk.now(command).times.sent[DIRECT.id] == desk.now(command).times.requested
    await desk.wait(1.0)
    # At 0, 250, 500 and 1000 ms, whatever Orion does.
    assert len(desk.fleet.stops) == 4


async def test_f40_a_robot_that_says_yes_and_drives_on_is_told_in_five_seconds() -> (
    None
):
    desk = Desk()
    desk.report("AGI", factor=1.0, reason="clear", linear=1.0)
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    desk.answer("LATCHED")
    asked = desk.clock.now

    states = []
    while desk.clock.now < asked + 5.05:
        desk.drive("AGI", desk.clock.now, linear=1.0)
        await desk.wait(0.1)
        states.append(desk.commander.machine("AGI").state)

    assert states[0] == "DELIVERED"
    assert states[-1] == "STILL_MOVING"
    assert "STANDING" not in states


async def test_i5_nothing_is_awaited_before_the_first_byte_on_any_transport() -> None:
    desk = Desk()
    broker: FakeContextBroker = desk.broker
    desk.journal.opened.clear()
    broker.opened.clear()
    desk.fleet.opened.clear()

    pressing = asyncio.create_task(
        desk.commander.stop(["AGI", "AGII"], "ana", desk.clock())
    )
    await settle()

    assert len(desk.fleet.stops) == len(broker.asked) == 2
    assert not pressing.done()
    for one in (desk.journal.opened, broker.opened, desk.fleet.opened):
        one.set()
    assert len(await pressing) == 2
