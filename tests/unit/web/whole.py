"""The whole server as programs and browsers see it; only what is outside is fake."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import httpx
from fastapi import FastAPI

from iveg.adapters.history.engine import history_url
from iveg.adapters.history.recorder import Recorder
from iveg.adapters.journal import FileJournal
from iveg.app import App, Connections
from iveg.asgi import create_app
from iveg.domain.accounts import digest_of
from iveg.domain.records import Record
from iveg.domain.transports import DIRECT, FIWARE, Transport
from iveg.settings import Settings
from iveg.vital.ports import CommandPort, Ports
from iveg.web.security.roles import MAY
from iveg.web.security.sessions import LASTS_S
from tests.databases import lay_history
from tests.fakes.context_broker import FakeContextBroker
from tests.fakes.fleet import FakeFleet
from tests.fakes.worker import FakeWorker

API_TOKEN = "a-token-for-programs"
STRANGER = "stranger"


class _Recorder(Recorder):
    """Remembers what is to be written."""

    def __init__(self, url: str, directory: Path) -> None:
        super().__init__(url, FileJournal(directory / "rows.jsonl"))
        self.records: list[Record] = []

    def enqueue(self, record: Record) -> None:
        self.records.append(record)


class _Connections(Connections):
    """STOP goes to robots and to a context broker that take everything."""

    def ports(self, settings: Settings) -> Ports:
        fleet = FakeFleet()
        ways: dict[Transport, CommandPort] = {
            DIRECT: fleet,
            FIWARE: FakeContextBroker(),
        }
        return replace(super().ports(settings), fleet=fleet, transports=ways)


@dataclass(frozen=True)
class WholeServer:
    """A server that is not running: nothing happens but what is asked.

    Attributes:
        records: What it would write into the history.
        headers: Who asks, by role.
    """

    parts: App
    app: FastAPI
    runner: asyncio.Runner
    client: httpx.AsyncClient
    records: list[Record]
    headers: dict[str, dict[str, str]]

    def sign_in_anew(self) -> None:
        """Give everybody a session, whoever's was ended."""
        self.headers.update(_headers_of_roles(self.app))

    def ask(
        self, role: str, method: str, path: str, **request: object
    ) -> httpx.Response:
        """What somebody of this role is answered."""
        told = dict(request.pop("headers", {})) | self.headers[role]  # type: ignore[call-overload]
        asking = self.client.request(method, path, headers=told, **request)  # type: ignore[arg-type]
        return self.runner.run(asking)


@contextmanager
def whole_server(folder: Path) -> Iterator[WholeServer]:
    """A server with its files in ``folder``."""
    url = history_url(None, folder)
    lay_history(url)
    chosen = Settings(api_token=API_TOKEN)
    connections = _Connections(chosen, folder)
    real, recorder = connections.recorder, _Recorder(url, folder)
    connections.recorder = recorder
    parts = App(chosen, folder, connections=connections)
    parts.worker = parts.packer = FakeWorker()
    app = create_app(parts)
    transport = httpx.ASGITransport(app, raise_app_exceptions=False)
    client = httpx.AsyncClient(transport=transport, base_url="http://iveg.test")
    with asyncio.Runner() as runner:
        yield WholeServer(
            parts, app, runner, client, recorder.records, _headers_of_roles(app)
        )
        runner.run(client.aclose())
        runner.run(connections.close())
        runner.run(real.close())


def _headers_of_roles(app: FastAPI) -> dict[str, dict[str, str]]:
    page = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
    sessions = app.state.authenticator.sessions
    told: dict[str, dict[str, str]] = {
        role: {**page, "Cookie": f"iveg={sessions.open('ana', role)}"} for role in MAY
    }
    token = sessions.open("ana", "admin")
    digest = digest_of(token)
    known = app.state.authenticator.people.book.sessions
    old = known[digest]
    known[digest] = replace(old, began=old.began - LASTS_S * 1.5)
    told["expired"] = {**page, "Cookie": f"iveg={token}"}
    told["program"] = {"Authorization": f"Bearer {API_TOKEN}"}
    return {**told, STRANGER: page}
