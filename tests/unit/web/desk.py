"""The web face over a pipeline with fakes, for somebody of any role."""

import asyncio
import contextlib
from collections import Counter
from collections.abc import AsyncIterator, Sequence
from functools import cache
from pathlib import Path

import httpx
import uvicorn

from iveg.adapters.reconciler import OwnSubscriptions
from iveg.adapters.recordings.pictures import PictureFiles
from iveg.asgi import WebParts, build_app, live_routers
from iveg.domain.equipment import Tile
from iveg.domain.greenhouse import Greenhouse
from iveg.vital.audit import AuditTrail
from iveg.web import notifications
from iveg.web.api import health
from iveg.web.bounded_http import bounded_http
from iveg.web.live import encoder
from iveg.web.live.pictures import Past
from iveg.web.live.socket import BoundedSocket
from iveg.web.pages.contexts import Site
from iveg.web.pages.drawing import Pages
from iveg.web.security.authentication import Authenticator, Credentials
from iveg.web.security.people import People
from iveg.web.security.roles import Role
from iveg.web.views import Views
from tests.fakes.accounts import FakeBook, FakePasswords
from tests.fakes.recordings import input_recorder
from tests.fakes.worker import FakeWorker
from tests.unit.vital.desk import FIELD, Desk

HOST = "iveg.test"
API_TOKEN = "a-token-for-programs"
SECRET, LINK = "ab" * 32, "cd" * 32
TENANT = {"Fiware-Service": "agroconnect", "Fiware-ServicePath": "/greenhouse"}


@cache
def _pages(site: Site) -> Pages:
    return Pages(site)


class WebDesk(Desk):
    """A desk that browsers, programs and Orion can reach."""

    def __init__(
        self,
        robots: tuple[str, ...] = ("AGI", "AGII"),
        greenhouse: Greenhouse = FIELD,
        tiles: Sequence[Tile] = (),
        recordings: Path = Path("nowhere"),
    ) -> None:
        super().__init__(robots, greenhouse, tiles=tiles)
        self.subscriptions = OwnSubscriptions(frozenset({"ours"}))
        self.queues = health.Queues({"ingest": 3}, {"history": 2})
        self.trail = AuditTrail(self.sink, self.ids)
        self.book, self.passwords = FakeBook(), FakePasswords()
        self.people = People(self.book, self.passwords, self.clock)
        self.authenticator = Authenticator(
            Credentials(LINK, API_TOKEN), self.people, self.trail
        )
        self.rules = self.parts.rules
        self.rule_store = self.choices.rules
        self.detector_store = self.choices.out_of_service
        self.word_store = self.choices.words
        self.counters = Counter({"some": 1})
        self.views = Views(self.parts, lambda: self.counters)
        self.encoder = encoder.Encoder(self.views, self.hub, self.clock)
        self.notifications = notifications.NotificationEndpoint(
            self.parts.core,
            self.ingest,
            SECRET,
            self.subscriptions,
            ("agroconnect", "/greenhouse"),
            self.parts.equipment.equipment.entities,
        )
        self.recordings = input_recorder(recordings, self.clock)
        self.face = WebParts(
            pipeline=self.parts,
            views=self.views,
            authenticator=self.authenticator,
            orion=self.notifications,
            site=Site("field", robots, "1", demo=True),
            queues=lambda: self.queues,
            clock=self.clock,
            worker=FakeWorker(),
            recordings=self.recordings,
            trail=self.trail,
            past=Past(PictureFiles(self.recordings.pictures)),
            encoder=self.encoder,
            accounts=lambda: "ok",
        )
        self.http = bounded_http()
        self.pages = _pages(self.face.site)
        self.app = build_app(self.face, self.pages, live_routers(self.face))

    # --- who asks -----------------------------------------------------------------

    def cookie(self, role: Role = "operator", name: str = "ana") -> dict[str, str]:
        """The header of a browser in which somebody is signed in."""
        return {"Cookie": f"iveg={self.authenticator.sessions.open(name, role)}"}

    def browser(self, role: Role = "operator") -> httpx.AsyncClient:
        """The page of somebody of this role."""
        page = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin", **self.cookie(role)}
        return self._client(page)

    def program(self) -> httpx.AsyncClient:
        return self._client({"Authorization": f"Bearer {API_TOKEN}"})

    def stranger(self) -> httpx.AsyncClient:
        return self._client({})

    def orion(self) -> httpx.AsyncClient:
        return self._client({"X-Iveg-Notify-Token": SECRET, **TENANT})

    def _client(self, headers: dict[str, str]) -> httpx.AsyncClient:
        transport = httpx.ASGITransport(self.app)
        return httpx.AsyncClient(
            transport=transport, base_url=f"http://{HOST}", headers=headers
        )

    # --- over a socket ------------------------------------------------------------

    @contextlib.asynccontextmanager
    async def serving(self) -> AsyncIterator[str]:
        """A real server; yields host and port."""
        config = uvicorn.Config(
            self.app,
            host="127.0.0.1",
            port=0,
            log_config=None,
            lifespan="off",
            http=self.http,
            ws=BoundedSocket,
            timeout_graceful_shutdown=1,
        )
        server = uvicorn.Server(config)
        serving = asyncio.create_task(server.serve())
        async with asyncio.timeout(30):
            while not server.started:  # noqa: ASYNC110 - uvicorn has no event
                await asyncio.sleep(0.01)
        try:
            port = server.servers[0].sockets[0].getsockname()[1]
            yield f"127.0.0.1:{port}"
        finally:
            server.should_exit = True
            await serving
