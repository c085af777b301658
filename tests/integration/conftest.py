"""Fixtures that run iVeg's programs on free ports and insist on clean logs."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest

from iveg.adapters.mqtt import BrokerAddress
from tests.integration.emulator_cloud import Cloud, broker, running, until
from tests.processes import EMULATOR, Site, site


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Site]:
    """Free ports, secrets and a data directory; nothing runs yet."""
    with site(tmp_path) as found:
        yield found


@pytest.fixture
def fiware(place: Site) -> Site:
    """The embedded FIWARE runs."""
    place.start("fiware").wait_until_ready()
    return place


@pytest.fixture
def served(place: Site) -> Site:
    """FIWARE and the dashboard run; no robot yet."""
    place.serve()
    return place


@pytest.fixture
def driving(served: Site) -> Site:
    """FIWARE, dashboard and two emulated robots, each a process of its own."""
    served.start(*EMULATOR)
    served.wait_until_live()
    return served


@pytest.fixture
async def address(tmp_path: Path) -> AsyncIterator[BrokerAddress]:
    """Of a broker on a free port."""
    async with broker(tmp_path) as where:
        yield where


@pytest.fixture
async def cloud(address: BrokerAddress) -> AsyncIterator[Cloud]:
    """A small iVeg on it, which hears and answers."""
    small = Cloud(address)
    async with running(asyncio.create_task(small.run())):
        await until(lambda: small.link.connected)
        yield small
