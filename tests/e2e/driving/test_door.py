"""The finished door lets no one in where they do not belong."""

import re
from collections.abc import Iterator
from contextlib import closing

import httpx
import pytest
from playwright.sync_api import Browser, expect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from iveg.web.security.headers import CONTENT_SECURITY_POLICY, MAX_BODY
from tests.processes import NO_TLS, Site

pytestmark = pytest.mark.e2e

OPEN = frozenset({"/healthz"})
JSON = {"Content-Type": "application/json"}


@pytest.fixture
def stranger(stack: Site) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=stack.url, trust_env=False, verify=NO_TLS) as client:
        yield client


@pytest.fixture
def operator(stack: Site) -> Iterator[httpx.Client]:
    """A browser with a session, its page's script not involved."""
    with httpx.Client(base_url=stack.url, trust_env=False, verify=NO_TLS) as client:
        client.get(stack.sign_in_link)
        yield client


def test_a_stranger_gets_in_nowhere(stack: Site, stranger: httpx.Client) -> None:
    let_in = [
        f"{method} {path}"
        for path, method in _routes(stack)
        if path not in OPEN
        and _ask(stranger, method, path).status_code not in (401, 403)
    ]

    assert let_in == []


def test_a_program_can_read_and_stop_and_nothing_else(stack: Site) -> None:
    with stack.api() as program:
        refused = {
            path.rsplit("/", 1)[1]
            for path, method in _routes(stack)
            if method == "post"
            and "/stop" not in path
            and _ask(program, method, path).status_code == 403
        }

    assert {"release", "resume"} <= refused


@pytest.mark.parametrize("path", ["/", "/history", "/docs", "/about", "/openapi.json"])
def test_pages_are_for_those_who_are_signed_in(
    stranger: httpx.Client, operator: httpx.Client, path: str
) -> None:
    assert stranger.get(path).status_code == 401
    assert operator.get(path).status_code == 200


@pytest.mark.parametrize("path", ["/", "/docs", "/about", "/healthz", "/api/v1/robots"])
def test_every_answer_binds_the_browser(operator: httpx.Client, path: str) -> None:
    headers = operator.get(path).headers

    assert headers["content-security-policy"] == CONTENT_SECURITY_POLICY
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cache-control"] == "no-store"


def test_a_link_that_is_wrong_gets_a_page_that_binds_the_browser_too(
    stranger: httpx.Client,
) -> None:
    answer = stranger.get("/?token=" + "0" * 32)

    assert answer.status_code == 401
    assert "set-cookie" not in answer.headers
    assert answer.headers["content-security-policy"] == CONTENT_SECURITY_POLICY


@pytest.mark.parametrize(
    "headers", [{}, {"X-IVEG": "1"}, {"X-IVEG": "1", "Origin": "http://evil.test"}]
)
def test_a_cookie_alone_moves_nothing(
    operator: httpx.Client, headers: dict[str, str]
) -> None:
    for action in ("stop", "resume"):
        answer = operator.post(f"/api/v1/robots/AGI/{action}", headers=headers)

        assert answer.status_code == 403


def test_a_form_is_not_json(operator: httpx.Client, stack: Site) -> None:
    headers = {"X-IVEG": "1", "Origin": stack.url, "Content-Type": "text/plain"}

    answer = operator.post("/api/v1/fleet/stop", content="{}", headers=headers)

    assert answer.status_code == 415


def test_what_is_too_large_is_refused_before_it_is_read(stack: Site) -> None:
    with stack.api() as program:
        for path in ("/api/v1/fleet/stop", "/ngsi/notifications"):
            answer = program.post(
                stack.url + path, content=b" " * (MAX_BODY + 1), headers=JSON
            )

            assert answer.status_code == 413


@pytest.mark.parametrize("secret", [None, "", "0" * 64])
def test_a_notification_with_a_wrong_secret_is_refused(
    stranger: httpx.Client, secret: str | None
) -> None:
    headers = {} if secret is None else {"X-Iveg-Notify-Token": secret}

    answer = stranger.post(
        "/ngsi/notifications",
        json={"subscriptionId": "0" * 24, "data": []},
        headers=headers,
    )

    assert answer.status_code == 401


def test_a_robot_that_does_not_exist_is_a_problem_not_an_empty_answer(
    stack: Site,
) -> None:
    with stack.api() as program:
        answer = program.get("robots/NOBODY")

    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["status"] == 404


def test_another_sites_page_cannot_open_the_live_socket(
    stack: Site, operator: httpx.Client
) -> None:
    with pytest.raises(InvalidStatus) as refusal:
        _dial(stack, operator.cookies["iveg"], "http://evil.test")

    assert refusal.value.response.status_code == 403


def test_a_socket_without_a_session_is_closed_with_a_code_that_pages_understand(
    stack: Site,
) -> None:
    with (
        _dial(stack, "not-a-session", stack.url) as live,
        pytest.raises(ConnectionClosed),
    ):
        live.recv(timeout=30)

    assert live.close_code == 4401


def test_a_socket_of_the_own_page_speaks(stack: Site, operator: httpx.Client) -> None:
    with _dial(stack, operator.cookies["iveg"], stack.url) as live:
        assert '"snapshot"' in str(live.recv(timeout=30))[:40]


def _routes(stack: Site) -> list[tuple[str, str]]:
    with stack.api() as program:
        document = program.get(f"{stack.url}/openapi.json").json()
    return [
        (path, method) for path, item in document["paths"].items() for method in item
    ]


def _ask(client: httpx.Client, method: str, path: str) -> httpx.Response:
    url = httpx.URL(client.base_url).copy_with(path=re.sub(r"\{\w+\}", "AGI", path))
    return client.request(method, url, headers=JSON)


def _dial(stack: Site, session: str, origin: str) -> ClientConnection:
    address = httpx.URL(stack.url).copy_with(scheme="ws", path="/live")
    headers = {"Cookie": f"iveg={session}", "Origin": origin}
    return connect(
        str(address),
        additional_headers=headers,
        subprotocols=[Subprotocol("iveg.2")],
        proxy=None,
    )


def test_the_link_signs_in_and_its_token_is_sent_in_no_address(
    stack: Site, browser: Browser
) -> None:
    with closing(browser.new_context(base_url=stack.url)) as context:
        page = context.new_page()
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))

        page.goto(stack.printed_link)
        page.wait_for_url(f"{stack.url}/")

        token = stack.settings["IVEG_SIGN_IN_TOKEN"]
        assert not [url for url in asked if token in url.partition("#")[0]]


def test_a_wrong_link_says_so(stack: Site, browser: Browser) -> None:
    with closing(browser.new_context(base_url=stack.url)) as context:
        page = context.new_page()

        page.goto(f"{stack.url}/signin#token={'0' * 32}")

        expect(page.locator("#signin-wrong")).to_be_visible()
        assert page.url == f"{stack.url}/signin"
