"""A greenhouse with one aisle, the morning of its history, and who reads its sheets."""

from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from datetime import date

import httpx
from fastapi import APIRouter, FastAPI

from iveg.adapters.history.recorder import Store
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import DriveLane, Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.records import Record
from iveg.vital.ports import Clock
from iveg.vital.record import Waiting
from iveg.web.pages.contexts import Site
from iveg.web.pages.drawing import Pages
from iveg.web.pages.sentences import start_of
from iveg.web.problems import install
from tests.fakes.doors import authenticator

GREENHOUSE = Greenhouse(
    "house", Rectangle(0, 0, 20, 20), lanes=(DriveLane("1", Rectangle(0, 0, 20, 4)),)
)
MORNING = start_of(date(2026, 11, 20)) + 9 * 3600.0


@asynccontextmanager
async def reader(
    url: str, records: Sequence[Record], routes: Callable[[Pages, Clock], APIRouter]
) -> AsyncIterator[httpx.AsyncClient]:
    """A viewer an hour later, of a history that holds the records."""
    store = Store(url)
    store.write([Waiting(one, n, 0.0) for n, one in enumerate(records, 1)])
    store.close()

    def now() -> Instant:
        return Instant(0.0, MORNING + 3600.0)

    app = FastAPI()
    install(app)
    app.state.authenticator = authenticator(now)
    pages = Pages(Site("house", ("AGI",), "1", demo=False))
    app.include_router(routes(pages, now))
    cookie = app.state.authenticator.sessions.open("ana", "viewer")
    async with httpx.AsyncClient(
        transport=httpx.ASGITransport(app=app),
        base_url="http://iveg",
        headers={"Cookie": f"iveg={cookie}"},
    ) as client:
        yield client
