"""Messages reach what apprise reaches, and no address is ever logged."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator
from pathlib import Path

import orjson
import pytest

from iveg.adapters.messages import load_messages, send_message
from iveg.domain.errors import DataFileError
from iveg.domain.events import Address, AlertItem, MessagePlan, MessageText
from iveg.web.pages.sentences import writer
from tests.builders import START
from tests.http_servers import Request, Response, http_server

TEXT = MessageText("iVeg: P1", "Open iVeg.")
WHOLE = """\
language = "en"
escalate_after_min = 5
[[address]]
name = "Ana"
url = "json://user:tomato@localhost/secret"
least = "P2"
[[escalation]]
name = "Guard"
url = "mailtos://iveg:tomato@coop.es"
"""


class Stand:
    """A web server on loopback that keeps what came."""

    def __init__(self, status: int = 200) -> None:
        self.status, self.bodies, self.port = status, list[bytes](), 0
        self.is_open, self.came = asyncio.Event(), asyncio.Event()
        self.is_open.set()

    async def answer(self, request: Request) -> Response:
        self.bodies.append(request.body)
        self.came.set()
        await self.is_open.wait()
        return Response(self.status)

    def address(self) -> Address:
        return Address("Ana", f"json://user:tomato@127.0.0.1:{self.port}/secret")


@contextlib.asynccontextmanager
async def standing(status: int = 200) -> AsyncIterator[Stand]:
    stand = Stand(status)
    async with http_server(stand.answer, "127.0.0.1", 0) as stand.port:
        yield stand


async def test_a_message_arrives_and_the_loop_goes_on_until_it_is_answered() -> None:
    async with standing() as stand:
        stand.is_open.clear()
        sending = asyncio.create_task(send_message(stand.address(), TEXT))
        await stand.came.wait()
        assert not sending.done()
        stand.is_open.set()
        assert await sending is None

    (body,) = [orjson.loads(one) for one in stand.bodies]
    assert (body["title"], body["message"]) == (TEXT.title, TEXT.body)


async def test_a_refusal_is_said_and_no_secret_logged(
    caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    caplog.set_level(logging.DEBUG)
    async with standing(500) as stand:
        assert await send_message(stand.address(), TEXT) == "not taken"
    assert await send_message(stand.address(), TEXT) == "not taken"

    shown = "".join((caplog.text, *capfd.readouterr(), repr(stand.address())))
    assert "tomato" not in shown
    assert "secret" not in shown


def test_a_file_names_addresses_and_those_of_an_escalation(tmp_path: Path) -> None:
    file = tmp_path / "messages.toml"
    file.write_text(WHOLE)

    assert load_messages(str(file)) == MessagePlan(
        (
            Address("Ana", "json://user:tomato@localhost/secret", "P2"),
            Address("Guard", "mailtos://iveg:tomato@coop.es", escalates=True),
        ),
        300.0,
        "en",
    )


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("json://user", "nothing://user", "address[0].url: is not one of apprise."),
        ('"P2"', '"P4"', "address[0].least"),
        ("escalate_after_min = 5", "escalate_after_min = 0", "escalate_after_min"),
        ('name = "Guard"\n', "", "escalation[0].name"),
        ('least = "P2"', "tomato", "is not TOML"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_without_its_secrets(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, right: str, wrong: str, said: str
) -> None:
    file = tmp_path / "messages.toml"
    file.write_text(WHOLE.replace(right, wrong))

    with pytest.raises(DataFileError) as refused:
        load_messages(str(file))

    assert said in str(refused.value)
    assert "tomato" not in str(refused.value) + caplog.text


def test_a_message_says_how_grave_and_when_in_the_readers_language() -> None:
    one = AlertItem("P1", START)

    assert writer("es")([one], False) == MessageText(
        "iVeg: alerta P1", "Una alerta P1 desde las 23:13:20. Abra iVeg para verla."
    )
    assert writer("en")([one, one], True) == MessageText(
        "iVeg: P1 alert not acknowledged",
        "2 alerts since 23:13:20; the gravest is P1. Open iVeg to see them.",
    )
