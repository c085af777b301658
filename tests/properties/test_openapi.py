"""What OpenAPI says of each route is what the route does, whoever asks for what.

Schemathesis makes requests of the document, such as it allows and such as it does not,
and compares each answer with it; this module adds who asks and what they may.
`IVEG_OPENAPI_EXAMPLES` sets how many of each sort a route is asked (`make deep`).
"""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import jsonschema_rs
import pytest
import requests
import schemathesis
from fastapi.routing import iter_route_contexts
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

from iveg.web.security.roles import MAY
from tests.routes import declared_action
from tests.unit.web.whole import STRANGER, WholeServer, whole_server

EXAMPLES = int(os.environ.get("IVEG_OPENAPI_EXAMPLES", "3"))
IS_LONG = EXAMPLES > 10
"""Then each run asks something else."""
KNOWN = {"robot_id": ("AGI", "AGII")}
"""What nobody guesses, and what there is."""
UNPROVEN = {f"urn:iveg:{one}" for one in ("wrong-password", "foreign-origin")}
"""Refused for what is in the body, or because no page of iVeg sends it."""
DOWN = {"GET /readyz"}
"""Answers 503 by design where no hop is there."""
CHECKS = [not_a_server_error, status_code_conformance, content_type_conformance]
NAMES = ("method", "url", "headers", "params", "json", "data")
Operation = APIOperation[Any, Any, Any, Any]
Sent = Case[Any]
Document = dict[str, Any]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[WholeServer]:
    with whole_server(tmp_path) as server:
        yield server


@pytest.mark.slow
def test_every_route_does_what_its_document_says_to_whoever_asks(
    server: WholeServer,
) -> None:
    document = server.app.openapi()
    actions = {
        (str(route.path_format), method): declared_action(route)
        for route in iter_route_contexts(server.app.routes)
        for method in route.methods or ()
    }
    found: dict[tuple[str, str], str] = {}
    asked: set[tuple[str, int]] = set()

    for operation in _operations(document):
        action = actions[operation.path, operation.method.upper()]
        assert action is not None
        for role, case, answer in _explored(server, operation):
            asked.add((operation.label, answer.status_code))
            about = f"{role}: {answer.request.url!s:.200} {case.body!r:.200}"
            complaints = [
                *_misserved(operation, action, role, case, answer),
                *_misshapen(document, operation.label, answer),
            ]
            found |= {(operation.label, one): about for one in complaints}

    assert found == {}
    assert len({label for label, _ in asked}) == len(list(_operations(document)))
    assert len({label for label, status in asked if status < 300}) > 40


def _operations(document: Document) -> Iterator[Operation]:
    for result in schemathesis.openapi.from_dict(document).get_all_operations():
        assert isinstance(result, Ok)
        yield result.ok()


def _explored(
    server: WholeServer, operation: Operation
) -> list[tuple[str, Sent, httpx.Response]]:
    """Who asked what, and was answered what."""
    answers = []
    server.sign_in_anew()
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
            if "sessions" in operation.path:
                server.sign_in_anew()
            for name in case.path_parameters.keys() & KNOWN.keys():
                if data.draw(st.booleans()):
                    case.path_parameters[name] = data.draw(st.sampled_from(KNOWN[name]))
            answers.append((role, case, _answer(server, role, case)))

        ask()
    return answers


def _modes(operation: Operation) -> list[GenerationMode]:
    """Nothing can be wrong about a request with neither query nor body."""
    if operation.query or operation.body:
        return [GenerationMode.POSITIVE, GenerationMode.NEGATIVE]
    return [GenerationMode.POSITIVE]


def _answer(server: WholeServer, role: str, case: Sent) -> httpx.Response:
    sent = case.as_transport_kwargs(base_url="http://iveg.test")
    request = requests.Request(**{name: sent.get(name) for name in NAMES}).prepare()
    headers = {
        name: str(value)
        for name, value in request.headers.items()
        if name.lower() not in ("content-length", "cookie", "authorization")
    }
    method, url = str(request.method), str(request.url)
    return server.ask(role, method, url, headers=headers, content=request.body or b"")


def _misserved(
    operation: Operation, action: str, role: str, case: Sent, answer: httpx.Response
) -> Iterator[str]:
    """What an answer has that neither the document nor the table of roles says."""
    may = action == "open" or (role != STRANGER and action in MAY[role])  # type: ignore[index]
    refused = answer.status_code == (401 if role == STRANGER else 403)
    refused &= answer.status_code != 403 or answer.json()["type"] not in UNPROVEN
    # What is no JSON is refused before anybody asks who sent it.
    if may == refused and answer.status_code != 400:
        yield f"{answer.status_code} for {role}, who may: {may}"
    if operation.label in DOWN and answer.status_code == 503:
        return
    try:
        case.validate_response(answer, checks=CHECKS)
    except FailureGroup as failures:
        yield from (f"{answer.status_code} {one!s:.300}" for one in failures.exceptions)


def _misshapen(document: Document, label: str, answer: httpx.Response) -> Iterator[str]:
    """What of a JSON answer is not as documented; schemathesis reads no tuples."""
    method, path = label.split()
    told = document["paths"][path][method.lower()]["responses"]
    media = answer.headers["content-type"].partition(";")[0]
    shape = told.get(str(answer.status_code), {}).get("content", {}).get(media, {})
    if shape.get("schema") and media.endswith("json"):
        whole = {**shape["schema"], "components": document["components"]}
        errors = jsonschema_rs.Draft202012Validator(whole).iter_errors(answer.json())
        yield from (f"{one.instance_path}: {one.message:.300}" for one in errors)
