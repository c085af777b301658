"""What OpenAPI says of each route is what the route does, whoever asks for what.

Schemathesis makes requests of the document, such as it allows and such as it does not,
and compares each answer with it; this module adds who asks and what they may.
`IVEG_OPENAPI_EXAMPLES` sets how many of each sort a route is asked (`make deep`).
"""

import asyncio
import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import httpx
import jsonschema_rs
import pytest
import requests
import schemathesis
from fastapi import FastAPI
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from schemathesis import APIOperation, Case, GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.core.failures import FailureGroup
from schemathesis.core.result import Ok
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    status_code_conformance,
)

from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.history.engine import history_url
from iveg.adapters.history.migrate import upgrade
from iveg.adapters.mail import Write
from iveg.app.dss import Dss
from iveg.app.outside import Outside, open_outside
from iveg.asgi import create_app
from iveg.domain.errors import NotRecordedError
from iveg.domain.messages import CHANNELS, Channel
from iveg.domain.transports import DIRECT, FIWARE, Transport
from iveg.pipeline.build import Ports
from iveg.pipeline.ports import CommandPort, MessageSender
from iveg.settings import Settings
from iveg.web.refusals import declared_actions
from iveg.web.security.roles import MAY
from iveg.web.security.sessions import IDLE_S
from tests.fakes.context_broker import FakeContextBroker
from tests.fakes.fleet import FakeFleet
from tests.fakes.messages import FakeSender
from tests.fakes.recordings import FakePast
from tests.fakes.worker import FakeWorker

EXAMPLES = int(os.environ.get("IVEG_OPENAPI_EXAMPLES", "3"))
IS_LONG = EXAMPLES > 10
"""Then each run asks something else."""
ADDRESS = "http://iveg.test"
API_TOKEN = "a-token-for-programs"
KNOWN = {"robot_id": ("AGI", "AGII"), "channel": CHANNELS}
"""What nobody guesses, and what there is."""
DOWN = {"GET /readyz"}
"""Answers 503 by design where no hop is there."""
CHECKS = (
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
)
STRANGER = "stranger"
Operation = APIOperation[Any, Any, Any, Any]
Sent = Case[Any]
Document = dict[str, Any]
Found = dict[tuple[str, str], str]


class _Outside(Outside):
    """Nothing leaves the machine."""

    def senders(self, _: Write) -> dict[Channel, MessageSender]:
        return {name: FakeSender(name) for name in CHANNELS}


class _Dss(Dss):
    """STOP goes to robots and to a context broker that take everything."""

    def _ports(self) -> Ports:
        fleet = FakeFleet()
        ways: dict[Transport, CommandPort] = {
            DIRECT: fleet,
            FIWARE: FakeContextBroker(),
        }
        return replace(super()._ports(), fleet=fleet, transports=ways)

    def is_robot_there(self) -> bool:
        """So that no experiment is started."""
        return True


@dataclass
class Desk:
    """An application, and who may ask it."""

    app: FastAPI
    runner: asyncio.Runner
    client: httpx.AsyncClient
    headers: dict[str, dict[str, str]]

    def ask(self, role: str, case: Sent) -> httpx.Response:
        """What somebody of this role is answered."""
        sent = case.as_transport_kwargs(base_url=ADDRESS)
        names = ("method", "url", "headers", "params", "json", "data")
        request = requests.Request(**{name: sent.get(name) for name in names}).prepare()
        told = {
            name: str(value)
            for name, value in request.headers.items()
            if name.lower() not in ("content-length", "cookie", "authorization")
        }
        asking = self.client.request(
            str(request.method),
            str(request.url),
            headers=told | self.headers[role],
            content=request.body or b"",  # type: ignore[arg-type]
        )
        return self.runner.run(asking)


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    upgrade(history_url(None, tmp_path))
    chosen = Settings(api_token=API_TOKEN)
    fleet = load_fleet(chosen.fleet, chosen.robots)
    real = open_outside(chosen, tmp_path, fleet)
    fields = ("stores", "link", "orion", "agent", "outbound")
    dss = _Dss(chosen, fleet, _Outside(*(getattr(real, one) for one in fields)))
    dss.worker = FakeWorker()  # type: ignore[assignment]
    past = FakePast()
    past.fails = NotRecordedError(0.0, None, None)
    dss.face = replace(dss.face, worker=FakeWorker(), past=past)
    app = create_app(dss)
    with asyncio.Runner() as runner:
        client = httpx.AsyncClient(
            transport=httpx.ASGITransport(app, raise_app_exceptions=False)
        )
        yield Desk(app, runner, client, _credentials(app))
        runner.run(client.aclose())
        runner.run(dss.outside.close())


@pytest.mark.slow
def test_every_route_does_what_its_document_says_to_whoever_asks(desk: Desk) -> None:
    document, actions = desk.app.openapi(), declared_actions(desk.app)
    found: Found = {}
    asked: set[tuple[str, int]] = set()

    for operation in _operations(document):
        action = actions[operation.path, operation.method.upper()]
        for role, case, answer in _explored(desk, operation):
            asked.add((operation.label, answer.status_code))
            about = f"{role}: {answer.request.url!s:.200} {case.body!r:.200}"
            for complaint in _complaints(operation, action, role, case, answer):
                found.setdefault((operation.label, complaint), about)

    assert found == {}
    assert len({label for label, _ in asked}) == len(list(_operations(document)))
    assert len({label for label, status in asked if status < 300}) > 40


def _operations(document: Document) -> Iterator[Operation]:
    for result in schemathesis.openapi.from_dict(document).get_all_operations():
        assert isinstance(result, Ok)
        yield result.ok()


def _explored(
    desk: Desk, operation: Operation
) -> list[tuple[str, Sent, httpx.Response]]:
    """Who asked what, and was answered what."""
    answers = []
    for mode in _modes(operation):

        @settings(
            max_examples=EXAMPLES,
            database=None,
            derandomize=not IS_LONG,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(
            st.sampled_from([*MAY, STRANGER]),
            operation.as_strategy(generation_mode=mode),
            st.data(),
        )
        def ask(role: str, case: Sent, data: st.DataObject) -> None:
            for name in case.path_parameters.keys() & KNOWN.keys():
                if data.draw(st.booleans()):
                    case.path_parameters[name] = data.draw(st.sampled_from(KNOWN[name]))
            answers.append((role, case, desk.ask(role, case)))

        ask()
    return answers


def _modes(operation: Operation) -> list[GenerationMode]:
    """Nothing can be wrong about a request with neither query nor body."""
    if operation.query or operation.body:
        return [GenerationMode.POSITIVE, GenerationMode.NEGATIVE]
    return [GenerationMode.POSITIVE]


def _complaints(
    operation: Operation,
    action: str,
    role: str,
    case: Sent,
    answer: httpx.Response,
) -> Iterator[str]:
    """What an answer has that neither the document nor the table of roles says."""
    may = action == "open" or (role != STRANGER and action in MAY[role])  # type: ignore[index]
    refusal = 401 if role == STRANGER else 403
    # What is no JSON is refused before anybody asks who sent it.
    if may == (answer.status_code == refusal) and answer.status_code != 400:
        yield f"{answer.status_code} for {role}, who may: {may}"
    if operation.label in DOWN and answer.status_code == 503:
        return
    try:
        case.validate_response(answer, checks=list(CHECKS))
    except FailureGroup as failures:
        yield from (f"{answer.status_code} {one!s:.300}" for one in failures.exceptions)


def _misshapen(document: Document, label: str, answer: httpx.Response) -> str | None:
    """What of a JSON answer is not as documented; schemathesis reads no tuples."""
    method, path = label.split()
    told = document["paths"][path][method.lower()]["responses"]
    media = answer.headers["content-type"].partition(";")[0]
    shape = told.get(str(answer.status_code), {}).get("content", {}).get(media, {})
    if not shape.get("schema") or not media.endswith("json"):
        return None
    whole = {**shape["schema"], "components": document["components"]}
    errors = jsonschema_rs.Draft202012Validator(whole).iter_errors(answer.json())
    return next((f"{one.instance_path}: {one.message:.300}" for one in errors), None)


def _credentials(app: FastAPI) -> dict[str, dict[str, str]]:
    """Headers of somebody of each role."""
    page = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
    sessions = app.state.authenticator.sessions
    told: dict[str, dict[str, str]] = {
        role: {**page, "Cookie": f"iveg={sessions.open('ana', role)}"} for role in MAY
    }
    token = sessions.open("ana", "admin")
    digest = hashlib.sha256(token.encode()).digest()
    old = sessions._sessions[digest]
    sessions._sessions[digest] = replace(old, began=old.began - IDLE_S * 2.5)
    told["expired"] = {**page, "Cookie": f"iveg={token}"}
    told["program"] = {"Authorization": f"Bearer {API_TOKEN}"}
    return {**told, STRANGER: page}
