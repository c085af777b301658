"""The WebSocket over a real server: snapshot, newest wins, nothing precious lost."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from typing import Any

import orjson
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Subprotocol

from iveg.domain.observations import Climate
from iveg.vital.publish import MAX_PENDING
from iveg.web.live.feed import FRAMES, SUBPROTOCOL, Painting, TelemetryFeed
from iveg.web.live.socket import Line
from iveg.web.security.roles import Role
from tests.builders import detection, scan
from tests.unit.vital.desk import settle
from tests.unit.web.desk import WebDesk

PROTOCOLS = [Subprotocol(SUBPROTOCOL)]


class Browser:
    """One connection: telemetry apart from what passes beside it, read as JSON."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.telemetry: list[Any] = []

    async def read(self) -> Any:
        """The next message that is no telemetry."""
        async with asyncio.timeout(30):
            while isinstance(message := await self.socket.recv(), bytes):
                end = 4 + int.from_bytes(message[:4], "little")
                self.telemetry.append(orjson.loads(message[4:end]))
        return orjson.loads(message)

    async def read_until(self, topic: str) -> list[Any]:
        """All frames up to the first of a topic."""
        frames = [await self.read()]
        while frames[-1]["topic"] != topic:
            frames.append(await self.read())
        return frames

    async def fill(self, desk: WebDesk) -> list[Any]:
        """Take a window of telemetry and say of none that it was painted."""
        beside = []
        while len(self.telemetry) < FRAMES:
            drive_on(desk)
            desk.hub.changed("health")
            beside += await self.read_until("health")
        return beside

    async def say(self, **message: object) -> None:
        await self.socket.send(orjson.dumps(message).decode())

    async def close_code(self) -> int | None:
        with contextlib.suppress(ConnectionClosed):
            async with asyncio.timeout(30):
                while True:
                    await self.socket.recv()
        return self.socket.close_code


def drive_on(desk: WebDesk) -> None:
    """AGI moves, and time passes."""
    desk.drive("AGI", desk.clock.now)
    desk.hear(scan(origin=desk.next_origin()))
    desk.clock.now += 0.02


@contextlib.asynccontextmanager
async def looking(
    desk: WebDesk, address: str, role: Role = "operator"
) -> AsyncIterator[Browser]:
    headers = desk.cookie(role)
    async with connect(
        f"ws://{address}/live",
        additional_headers=headers,
        origin=f"http://{address}",  # type: ignore[arg-type]
        subprotocols=PROTOCOLS,
        close_timeout=0.2,
    ) as socket:
        yield Browser(socket)


async def test_the_first_frame_is_the_snapshot_and_a_ping_has_the_servers_time() -> (
    None
):
    desk = WebDesk()
    desk.drive("AGI", 3.0)
    async with desk.serving() as address, looking(desk, address) as browser:
        first = await browser.read()
        await browser.say(type="ping", t=123.5)
        (pong,) = await browser.read_until("pong")

    assert first["topic"] == "snapshot"
    assert first["data"]["user"] == {"name": "ana", "role": "operator"}
    assert first["data"]["robots"][0]["pose"]["x"] == 3.0
    assert pong["data"] == {"t": 123.5, "server": desk.clock().wall}


@pytest.mark.parametrize(
    ("protocols", "after_s", "code"),
    [(PROTOCOLS, 13 * 3600.0, 4401), (None, 0.0, 4406)],
)
async def test_a_session_that_is_over_or_another_protocol_is_closed_with_its_code(
    protocols: list[Subprotocol] | None, after_s: float, code: int
) -> None:
    desk = WebDesk()
    async with desk.serving() as address:
        headers = desk.cookie()
        desk.clock.now += after_s
        async with connect(
            f"ws://{address}/live",
            additional_headers=headers,
            origin=f"http://{address}",  # type: ignore[arg-type]
            subprotocols=protocols,
        ) as socket:
            assert await Browser(socket).close_code() == code
    assert not desk.hub.subscribers


@pytest.mark.parametrize("origin", ["http://evil.test", "null", None])
async def test_a_foreign_origin_does_not_get_a_connection(origin: str | None) -> None:
    desk = WebDesk()
    async with desk.serving() as address:
        with pytest.raises(InvalidStatus) as refused:
            await connect(
                f"ws://{address}/live",
                additional_headers=desk.cookie(),
                origin=origin,  # type: ignore[arg-type]
            )

    assert refused.value.response.status_code == 403


def test_f22_a_version_is_encoded_once_for_all_browsers() -> None:
    desk = WebDesk()

    desk.hear(Climate(20.0))
    first, again = desk.encoder.frame("climate"), desk.encoder.frame("climate")
    desk.hear(Climate(21.0))

    assert first is again
    assert desk.encoder.frame("climate") != first


async def test_a_page_that_never_answers_gets_one_window_and_everything_else() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        before = len(desk.event_log.lines)
        told = await browser.fill(desk)
        for number in range(300):
            drive_on(desk)
            desk.look("AGI", detection(f"thing-{number}", 9.0))
        (command,) = await desk.commander.stop(["AGI"], "ana", desk.clock())
        await settle()
        desk.answer("LATCHED")
        for topic in ("alerts", "rule", "health"):
            desk.hub.changed(topic)
            told += await browser.read_until(topic)
        desk.hub.append("problem", None)
        told += await browser.read_until("problem")

    lines = [one["data"]["id"] for one in told if one["topic"] == "log"]
    topic = f"commands/{command.command_id}"
    steps = [one["data"]["state"] for one in told if one["topic"] == topic]
    assert [one["frame"] for one in browser.telemetry] == list(range(1, FRAMES + 1))
    assert lines == [line.id for line in list(desk.event_log.lines)[before:]]
    assert steps == ["REQUESTED", "SENT", "DELIVERED"]


async def test_everything_says_when_it_was_true_on_one_clock() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        told = [await browser.read()]
        desk.clock.now += 5.0
        desk.drive("AGI")
        while not browser.telemetry:
            desk.hub.changed("health")
            told += await browser.read_until("health")

    now = desk.clock().mono
    assert now - told[0]["at"] == 5.0
    assert {now - one["at"] for one in told[1:]} == {0.0}
    assert browser.telemetry[0]["moves"][0][1] == now


async def test_f23_who_lets_events_pile_up_is_closed_with_4008() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        for number in range(MAX_PENDING + 1):
            desk.hub.append("problem", {"id": number})

        assert await browser.close_code() == 4008


class Deaf:
    """A browser's line that takes nothing."""

    code = 0

    async def send_text(self, _: str) -> None:
        """Wait for room, in vain."""
        await asyncio.Event().wait()

    async def close(self, code: int) -> None:
        """Note why."""
        self.code = code


async def test_f23_who_does_not_read_what_is_sent_is_closed_with_4008() -> None:
    desk, deaf = WebDesk(), Deaf()
    subscriber = desk.hub.join()
    feed = TelemetryFeed(desk.encoder.telemetry, subscriber, Painting(desk.latency))
    line = Line(deaf, subscriber, desk.encoder, feed, desk.clock, 0.01)  # type: ignore[arg-type]
    subscriber.changed("health")

    with pytest.raises(ConnectionAbortedError):
        await line.send()

    assert deaf.code == 4008


@pytest.mark.parametrize(
    ("robot_id", "stopped"), [("AGI", ["AGI"]), (None, ["AGI", "AGII"])]
)
async def test_a_stop_is_pressed_and_answered_by_the_commands_own_topic(
    robot_id: str | None, stopped: list[str]
) -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address, "viewer") as browser:
        await browser.read()
        await browser.say(type="stop", robot_id=robot_id, press_id="p", pressed_at=1.0)
        frames = await browser.read_until("log")

    assert [name for name, _ in desk.fleet.stops] == stopped
    assert frames[0]["topic"].startswith("commands/")
    assert frames[0]["data"]["state"] == "REQUESTED"


async def test_a_revoked_session_can_no_longer_stop() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        desk.authenticator.people.book.sessions.clear()
        await browser.say(type="stop", robot_id="AGI")

        assert await browser.close_code() == 4401
    assert desk.fleet.stops == []
