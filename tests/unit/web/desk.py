"""The web face over a pipeline with fakes, for somebody of any role."""

import asyncio
import contextlib
from collections import Counter
from collections.abc import AsyncIterator
from typing import Any

import httpx
import uvicorn
from fastapi import FastAPI

from iveg.adapters import web_push
from iveg.adapters.outside import is_public_target
from iveg.domain.messages import CHANNELS, Contacts
from iveg.domain.observations import Instant
from iveg.domain.stop import Press
from iveg.models.snapshot import Server, Snapshot, User
from iveg.ngsi.codec import format_stamp
from iveg.pipeline import topics
from iveg.pipeline.mapping import Mapper
from iveg.pipeline.messenger import Messenger
from iveg.pipeline.rules import Rules
from iveg.web import notifications, problems
from iveg.web.api import (
    alerts,
    commands,
    costmap,
    health,
    latency,
    messages,
    metrics,
    robots,
    rule,
)
from iveg.web.live import socket
from iveg.web.live.bounded import BoundedSocket
from iveg.web.prompt import prompt_http
from iveg.web.security import headers
from iveg.web.security.authentication import (
    Authenticator,
    NotifySecret,
    Principal,
    Role,
)
from iveg.web.views import Views
from tests.fakes.messages import FakeContacts, FakeSender
from tests.fakes.rule_store import FakeRuleStore
from tests.unit.pipeline.desk import Desk

HOST = "iveg.test"
API_TOKEN = "a-token-for-programs"
SECRET = "ab" * 32
TENANT = {"Fiware-Service": "agroconnect", "Fiware-ServicePath": "/greenhouse"}


class WebDesk(Desk):
    """A desk that browsers, programs and Orion can reach."""

    def __init__(self, robots_: tuple[str, ...] = ("AGI", "AGII")) -> None:
        super().__init__(robots_)
        self.heard: list[Instant] = []
        self.queues = metrics.Queues({"ingest": 3}, {"history": 2}, {"stop_send": 1})
        self.authenticator = Authenticator(
            sign_in_token="cd" * 32,
            api_token=API_TOKEN,
            clock=self.clock,
        )
        self.mapper = Mapper(self.world, self.evaluator.greenhouse.bounds)
        self.rule_store = FakeRuleStore()
        self.rules = Rules(self.evaluator, self.rule_store, self.event_log, [])
        self.contact_store = FakeContacts()
        self.senders = {name: FakeSender(name) for name in CHANNELS}
        self.messenger = Messenger(
            Contacts(),
            self.contact_store,
            {**self.senders},
            self.evaluator.alerts,
            self.event_log,
            self.clock,
        )
        self.views = Views(
            self.evaluator,
            self.commander,
            self.event_log,
            self.health_monitor,
            lambda: Counter({"some": 1}),
        )
        self.encoder = socket.Encoder(self.views, self.hub, self.clock)
        self.app = FastAPI()
        self.app.state.authenticator = self.authenticator
        for router in self._routers():
            self.app.include_router(router)
        problems.install(self.app)
        self.app.add_middleware(headers.BodyLimit)
        orion = notifications.NotificationEndpoint(
            self.ingest,
            NotifySecret(SECRET),
            self.clock,
            "ours".__eq__,
            ("agroconnect", "/greenhouse"),
            self.heard.append,
            "thinned".__eq__,
        )
        self.app.router.routes.append(orion.route())
        self.notifications = orion
        self.app.add_middleware(notifications.NotificationsFirst, endpoint=orion)

    def _routers(self) -> list[Any]:
        return [
            socket.router(
                self.hub,
                self.encoder,
                self.snapshot,
                self.clock,
                self.stop,
                self.latency.watch,
            ),
            robots.router(self.views, self.clock),
            costmap.router(self.mapper, self.evaluator, self.clock),
            commands.router(self.commander, self.clock),
            alerts.router(self.evaluator, self.clock),
            rule.router(self.rules, self.clock),
            messages.router(
                messages.Desk(
                    self.messenger,
                    web_push.new_key,
                    web_push.public_key,
                    web_push.is_public_key,
                    is_public_target,
                    self.ids,
                    self.clock,
                )
            ),
            health.router(self.clock, self.views.health),
            latency.router(self.latency.watch, self.clock),
            metrics.router(
                self.clock,
                self.views.health,
                self.latency.watch,
                lambda: self.queues,
            ),
        ]

    # --- what the web asks --------------------------------------------------------

    def snapshot(self, principal: Principal, now: Instant) -> Snapshot:
        return Snapshot(
            t=format_stamp(now.wall),
            server=Server(boot="iveg-boot", version="1", demo=True, wall=now.wall),
            user=User(name=principal.name, role=principal.role),
            **topics.read_all(self.views, now),
        )

    async def stop(self, robot_id: str | None, by: str, press: Press) -> None:
        targets = self.commander.machines if robot_id is None else [robot_id]
        await self.commander.stop(targets, by, self.clock(), press)

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
            http=prompt_http(self.notifications),
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
