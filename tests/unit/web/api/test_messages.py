"""Issue 13.23: operators say who is told outside iVeg; no secret comes out."""

from typing import Any

import httpx
import pytest

from iveg.adapters.push_encryption import encode, new_key, public_key
from iveg.domain.messages import AlertItem, MessageText, OutboundMessage
from iveg.web.pages.message_texts import writer
from iveg.web.security.roles import Role
from tests.builders import START
from tests.unit.web.desk import WebDesk

ANA = {"who": "Ana", "address": "ana@coop.es"}
EMAIL = {
    "on": True,
    "server": "smtp.coop.es",
    "port": 465,
    "security": "tls",
    "user": "iveg",
    "password": "tomato",
    "sender": "iveg@coop.es",
    "recipients": [ANA],
}
HOOK = {"on": True, "who": "Guardia", "url": "https://hooks.coop.es/s3cret"}
PUSH = {"on": True, "contact": "ana@coop.es"}


def device(endpoint: str = "https://push.coop.es/1") -> dict[str, Any]:
    keys = {"p256dh": public_key(new_key()), "auth": encode(b"s" * 16)}
    return {"who": "Ana", "endpoint": endpoint, "keys": keys, "language": "es"}


async def ask(
    desk: WebDesk,
    method: str,
    path: str = "",
    body: object = None,
    role: Role = "operator",
) -> httpx.Response:
    async with desk.browser(role) as browser:
        return await browser.request(method, f"/api/v1/messages{path}", json=body)


async def test_all_of_it_is_off_at_first() -> None:
    told = (await ask(WebDesk(), "GET")).json()

    assert [told[one]["on"] for one in ("push", "email", "webhook")] == [False] * 3
    assert told["push"]["public_key"] is None


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("GET", "", None),
        ("PUT", "/email", EMAIL),
        ("PUT", "/webhook", HOOK),
        ("PUT", "/push", PUSH),
        ("POST", "/devices", device()),
        ("DELETE", "/devices/D1", None),
        ("POST", "/email/test", {}),
    ],
)
async def test_only_an_operator_reads_changes_or_tries_it(
    method: str, path: str, body: object
) -> None:
    desk = WebDesk()

    answer = await ask(desk, method, path, body, "viewer")

    assert answer.status_code == 403
    assert desk.contact_store.saved == []


async def test_no_secret_comes_out_again() -> None:
    desk = WebDesk()
    await ask(desk, "PUT", "/email", EMAIL)
    await ask(desk, "PUT", "/webhook", HOOK)
    await ask(desk, "PUT", "/push", PUSH)
    mine = device()
    await ask(desk, "POST", "/devices", mine)

    answer = await ask(desk, "GET")

    secrets = ["tomato", "s3cret", mine["keys"]["auth"], mine["endpoint"]]
    secrets.append(desk.services.messenger.contacts.push.key)
    assert [one for one in secrets if one in answer.text] == []
    assert answer.json()["email"]["has_password"] is True
    assert answer.json()["webhook"]["host"] == "hooks.coop.es"
    assert [one["who"] for one in answer.json()["push"]["devices"]] == ["Ana"]


async def test_a_change_is_on_disk_and_in_the_log_with_its_author() -> None:
    desk = WebDesk()

    answer = await ask(desk, "PUT", "/email", EMAIL)

    assert answer.status_code == 200
    assert desk.contact_store.saved[-1].email.password == "tomato"
    line = desk.event_log.lines[-1]
    assert line.key == "log.messages_changed.email"
    assert line.slots == {"by": "ana"}
    assert "tomato" not in line.slots


async def test_an_empty_password_keeps_the_one_that_is_there() -> None:
    desk = WebDesk()
    await ask(desk, "PUT", "/email", EMAIL)

    await ask(desk, "PUT", "/email", {**EMAIL, "password": None, "least": "P2"})

    kept = desk.services.messenger.contacts.email
    assert (kept.password, kept.least) == ("tomato", "P2")


@pytest.mark.parametrize(
    "other",
    [{"server": "smtp.other.es"}, {"user": "eva"}, {"security": "starttls"}],
)
async def test_a_kept_password_is_sent_to_no_other_server(other: Any) -> None:
    desk = WebDesk()
    await ask(desk, "PUT", "/email", EMAIL)

    answer = await ask(desk, "PUT", "/email", {**EMAIL, "password": None, **other})

    assert answer.status_code == 422
    assert desk.services.messenger.contacts.email.server == "smtp.coop.es"


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/email", {**EMAIL, "port": 22}),
        ("/email", {**EMAIL, "server": "a b"}),
        ("/email", {**EMAIL, "sender": "ana@coop.es\r\nBcc: eva@coop.es"}),
        ("/email", {**EMAIL, "recipients": []}),
        ("/email", {**EMAIL, "recipients": [{"who": " ", "address": "a@b.es"}]}),
        ("/email", {**EMAIL, "recipients": [ANA] * 11}),
        ("/webhook", {**HOOK, "url": "http://hooks.coop.es/"}),
        ("/webhook", {**HOOK, "url": "https://127.0.0.1/"}),
        ("/webhook", {**HOOK, "url": "https://169.254.169.254/latest"}),
        ("/webhook", {"on": True, "who": "Guardia"}),
        ("/push", {**PUSH, "contact": "nobody"}),
    ],
)
async def test_what_cannot_be_told_is_refused(path: str, body: object) -> None:
    desk = WebDesk()

    answer = await ask(desk, "PUT", path, body)

    assert answer.status_code == 422
    assert desk.contact_store.saved == []


async def test_push_is_switched_on_without_an_address() -> None:
    desk = WebDesk()

    told = (await ask(desk, "PUT", "/push", {"on": True})).json()["push"]

    assert (told["on"], told["contact"]) == (True, "")
    assert told["public_key"]


async def test_the_same_browser_again_takes_its_own_place() -> None:
    desk = WebDesk()
    await ask(desk, "PUT", "/push", PUSH)
    await ask(desk, "POST", "/devices", device())

    told = (await ask(desk, "POST", "/devices", device())).json()

    assert len(told["push"]["devices"]) == 1


async def test_a_browser_can_be_told_no_more() -> None:
    desk = WebDesk()
    await ask(desk, "PUT", "/push", PUSH)
    told = (await ask(desk, "POST", "/devices", device())).json()
    name = told["push"]["devices"][0]["device_id"]

    left = await ask(desk, "DELETE", f"/devices/{name}")
    again = await ask(desk, "DELETE", f"/devices/{name}")

    assert left.json()["push"]["devices"] == []
    assert again.status_code == 404


@pytest.mark.parametrize(
    "wrong",
    [
        {"endpoint": "https://192.168.1.1/push"},
        {"endpoint": "http://push.coop.es/1"},
        {"keys": {"p256dh": "AAAA", "auth": encode(b"s" * 16)}},
    ],
)
async def test_a_push_service_at_home_or_a_key_that_is_none_is_refused(
    wrong: Any,
) -> None:
    desk = WebDesk()
    await ask(desk, "PUT", "/push", PUSH)

    answer = await ask(desk, "POST", "/devices", {**device(), **wrong})

    assert answer.status_code == 422
    assert desk.services.messenger.contacts.push.devices == ()


async def test_a_test_says_what_came_of_it_and_the_next_one_waits() -> None:
    desk = WebDesk()

    answer = await ask(desk, "POST", "/webhook/test")
    at_once = await ask(desk, "POST", "/webhook/test")

    assert [one["to"] for one in answer.json()["told"]] == ["Ana"]
    assert (at_once.status_code, at_once.headers["retry-after"]) == (429, "5")
    assert len(desk.senders["webhook"].sent) == 1


async def test_a_full_disk_changes_nothing() -> None:
    desk = WebDesk()
    desk.contact_store.full = True

    answer = await ask(desk, "PUT", "/webhook", HOOK)

    assert answer.status_code == 503
    assert desk.services.messenger.contacts.webhook.url == ""


def test_a_letter_says_how_grave_and_when_in_the_readers_language() -> None:
    one = AlertItem("01J", "P1", "stop_unconfirmed", START)
    write = writer()

    assert write(OutboundMessage([one]), "es") == MessageText(
        "iVeg: alerta P1", "Una alerta P1 desde las 23:13:20. Abra iVeg para verla."
    )
    assert write(OutboundMessage([one, one]), "en").body == (
        "2 alerts since 23:13:20; the gravest is P1. Open iVeg to see them."
    )
    assert write(OutboundMessage(), "en").title == "iVeg: test"
