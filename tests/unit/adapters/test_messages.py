"""Messages reach what apprise reaches, and no address is ever logged."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator
from pathlib import Path

import orjson
import pytest

from iveg.adapters.messages import AppriseSender, load_messages
from iveg.domain.errors import DataFileError
from iveg.domain.events import Address, AlertItem, MessagePlan, MessageText
from iveg.web.pages.sentences import writer
from tests.builders import START

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
        self.held = asyncio.Event()
        self.held.set()
        self.came = asyncio.Event()

    async def serve(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        head = (await reader.readuntil(b"\r\n\r\n")).lower()
        length = int(head.partition(b"content-length:")[2].split()[0])
        self.bodies.append(await reader.readexactly(length))
        self.came.set()
        await self.held.wait()
        answer = f"HTTP/1.1 {self.status} X\r\nContent-Length: 0\r\n"
        writer.write(f"{answer}Connection: close\r\n\r\n".encode())
        await writer.drain()
        writer.close()
        await writer.wait_closed()

    def address(self) -> Address:
        return Address("Ana", f"json://user:tomato@127.0.0.1:{self.port}/secret")


@contextlib.asynccontextmanager
async def standing(stand: Stand) -> AsyncIterator[Stand]:
    server = await asyncio.start_server(stand.serve, "127.0.0.1", 0)
    stand.port = server.sockets[0].getsockname()[1]
    async with server:
        yield stand


async def test_a_message_arrives_by_apprise() -> None:
    async with standing(Stand()) as stand:
        assert await AppriseSender().send(stand.address(), TEXT) is None

    (body,) = [orjson.loads(one) for one in stand.bodies]
    assert (body["title"], body["message"]) == (TEXT.title, TEXT.body)


async def test_the_loop_goes_on_while_an_address_does_not_answer() -> None:
    async with standing(Stand()) as stand:
        stand.held.clear()
        sending = asyncio.create_task(AppriseSender().send(stand.address(), TEXT))
        await stand.came.wait()
        assert not sending.done()
        stand.held.set()
        assert await sending is None


async def test_a_refusal_is_said_and_no_secret_logged(
    caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    caplog.set_level(logging.DEBUG)
    async with standing(Stand(500)) as stand:
        assert await AppriseSender().send(stand.address(), TEXT) == "not taken"
    assert await AppriseSender().send(stand.address(), TEXT) == "not taken"

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
        (
            "json://user",
            "nothing://user",
            "address[0].url: is not one of apprise.",
        ),
        ('"P2"', '"P4"', "address[0].least"),
        ("escalate_after_min = 5", "escalate_after_min = 0", "escalate_after_min"),
        ('name = "Guard"\n', "", "escalation[0].name"),
        ('least = "P2"', "tomato", "is not TOML"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_without_its_secrets(
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    right: str,
    wrong: str,
    said: str,
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
