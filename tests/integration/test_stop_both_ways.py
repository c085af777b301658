"""A STOP on two transports, neither of which waits for the other (F7, I5)."""

import asyncio
import time

import pytest

from iveg.adapters.orion import OrionClient
from iveg.adapters.transports import OrionTransport
from iveg.domain.errors import HopError
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


async def test_i5_nothing_is_awaited_before_the_first_byte_on_any_transport() -> None:
    desk = Desk()
    desk.journal.opened.clear()
    desk.broker.opened.clear()
    desk.fleet.opened.clear()

    pressing = asyncio.create_task(
        desk.commander.stop(["AGI", "AGII"], "ana", desk.clock())
    )
    await settle()

    assert len(desk.fleet.stops) == len(desk.broker.asked) == 2
    assert not pressing.done()
    for one in (desk.journal.opened, desk.broker.opened, desk.fleet.opened):
        one.set()
    assert len(await pressing) == 2
