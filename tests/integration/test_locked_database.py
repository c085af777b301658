"""What people's safety needs waits for no database, also just after a start."""

import asyncio
import sqlite3
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from pathlib import Path

import httpx
import pytest

from iveg.adapters import clock
from iveg.app import App
from iveg.asgi import create_app
from iveg.domain.observations import Received
from iveg.settings import Settings
from tests.builders import odometry
from tests.ports import free_ports

OWN_PAGE = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}

LOCKED_S = 90.0
"""How long SQLite waits for somebody else's lock here; who does not wait for it is done
while that lasts, on a machine as busy as it may be."""


@asynccontextmanager
async def running(directory: Path) -> AsyncIterator[tuple[App, httpx.AsyncClient]]:
    """An iVeg whose neighbours are all away, and a browser before it."""
    mqtt, orion, agent = free_ports(3)
    settings = Settings(
        mqtt_url=f"mqtt://127.0.0.1:{mqtt}",
        orion_url=f"http://127.0.0.1:{orion}",
        database_url=f"sqlite:///{directory / 'iveg.sqlite'}?timeout={LOCKED_S}",
        iota_url=f"http://127.0.0.1:{agent}",
        sign_in_token="ab" * 32,
    )
    app = App(settings, directory)
    transport = httpx.ASGITransport(create_app(app))
    browser = httpx.AsyncClient(transport=transport, base_url="http://iveg")
    async with browser, app.running():
        yield app, browser


@contextmanager
def locked(directory: Path) -> Iterator[None]:
    locker = sqlite3.connect(directory / "iveg.sqlite", isolation_level=None)
    locker.execute("BEGIN EXCLUSIVE")
    try:
        yield
    finally:
        locker.execute("ROLLBACK")
        locker.close()


async def so(fact: Callable[[], bool]) -> None:
    """Return when it is so; the caller has a deadline."""
    while not fact():  # noqa: ASYNC110 - nothing tells of it
        await asyncio.sleep(0.01)


async def press(browser: httpx.AsyncClient) -> httpx.Response:
    return await browser.post("/api/v1/robots/AGI/stop", headers=OWN_PAGE)


@pytest.mark.filterwarnings("ignore::ResourceWarning")
async def test_f20_with_a_locked_database_iveg_starts_stops_signs_in_and_judges(
    tmp_path: Path,
) -> None:
    async with running(tmp_path) as (app, browser):
        signed_in = await browser.post(
            "/signin", json={"token": "ab" * 32}, headers=OWN_PAGE
        )
        assert (await press(browser)).status_code == 202
        cookies = {**browser.cookies}
        await app.connections.recorder.caught_up.wait()
    assert signed_in.status_code == 204

    with ExitStack() as stack:
        stack.enter_context(locked(tmp_path))
        async with asyncio.timeout(LOCKED_S), running(tmp_path) as (app, browser):
            browser.cookies.update(cookies)
            async with asyncio.timeout(LOCKED_S / 2):
                machine = app.pipeline.commander.machine("AGI")
                await so(lambda: machine.wants_stop)
                read = await browser.get("/api/v1/robots")
                pressed = await press(browser)
                app.pipeline.ingest.enqueue(Received(odometry("AGI", 3.0), clock.now()))
                robot = app.core.world.robot("AGI")
                await so(lambda: robot.odometry is not None)
                judged = app.pipeline.evaluator.speed_limits["AGI"]

            written = app.connections.recorder.counters["history_written"]
            stack.close()  # an end that waits for the database is another matter

    assert machine.stop is not None
    assert machine.stop.reason == "reasserted"
    assert (read.status_code, pressed.status_code) == (200, 202)
    assert judged.speed_factor == 0.5
    assert written == 0
