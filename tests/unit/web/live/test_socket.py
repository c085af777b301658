"""The WebSocket over a real server: snapshot, newest wins, nothing precious lost."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

import orjson
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Subprotocol

from iveg.domain.observations import Climate
from iveg.pipeline.publish import MAX_PENDING
from iveg.web.live.feed import TelemetryFeed
from iveg.web.live.line import Line
from iveg.web.live.pacing import SUBPROTOCOL
from iveg.web.live.painting import Painting
from iveg.web.security.roles import Principal, Role
from tests.builders import detection
from tests.unit.pipeline.desk import settle
from tests.unit.web.desk import API_TOKEN, WebDesk

PROTOCOLS = [Subprotocol(SUBPROTOCOL)]


class Browser:
    """One connection and what passes beside telemetry, read as JSON."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket

    async def read(self) -> Any:
        async with asyncio.timeout(30):
            while isinstance(message := await self.socket.recv(), bytes):
                pass
        return orjson.loads(message)

    async def read_until(self, topic: str) -> list[Any]:
        """All frames up to the first of a topic."""
        frames = [await self.read()]
        while frames[-1]["topic"] != topic:
            frames.append(await self.read())
        return frames

    async def say(self, **message: object) -> None:
        await self.socket.send(orjson.dumps(message).decode())

    async def close_code(self) -> int | None:
        with contextlib.suppress(ConnectionClosed):
            async with asyncio.timeout(30):
                while True:
                    await self.socket.recv()
        return self.socket.close_code


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


# --- coming in --------------------------------------------------------------------


async def test_the_first_frame_is_the_snapshot() -> None:
    desk = WebDesk()
    desk.drive("AGI", 3.0)
    async with desk.serving() as address, looking(desk, address) as browser:
        first = await browser.read()

    assert first["topic"] == "snapshot"
    assert first["data"]["user"] == {"name": "ana", "role": "operator"}
    assert first["data"]["robots"][0]["pose"]["x"] == 3.0


async def test_without_a_session_it_is_closed_with_4401() -> None:
    desk = WebDesk()
    async with desk.serving() as address, connect(f"ws://{address}/live") as socket:
        assert await Browser(socket).close_code() == 4401


async def test_a_session_that_is_over_is_closed_with_4401() -> None:
    desk = WebDesk()
    async with desk.serving() as address:
        headers = desk.cookie()
        desk.clock.now += 13 * 3600.0
        async with connect(
            f"ws://{address}/live",
            additional_headers=headers,
            origin=f"http://{address}",  # type: ignore[arg-type]
        ) as socket:
            assert await Browser(socket).close_code() == 4401


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


async def test_a_program_may_look_with_its_token() -> None:
    desk = WebDesk()
    headers = {"Authorization": f"Bearer {API_TOKEN}"}
    async with (
        desk.serving() as address,
        connect(
            f"ws://{address}/live",
            additional_headers=headers,
            subprotocols=PROTOCOLS,
        ) as socket,
    ):
        first = await Browser(socket).read()

    assert first["data"]["user"]["role"] == "program"


async def test_who_has_gone_is_forgotten() -> None:
    desk = WebDesk()
    async with desk.serving() as address:
        async with looking(desk, address) as browser:
            await browser.read()
            assert desk.hub.watchers == 1
        async with asyncio.timeout(30):
            while desk.hub.watchers:  # noqa: ASYNC110 - the hub has no event for it
                await asyncio.sleep(0.01)


# --- what changes -----------------------------------------------------------------


async def test_no_log_line_and_no_step_of_a_command_is_dropped() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        before = len(desk.event_log.lines)
        for number in range(300):
            desk.look("AGI", detection(f"thing-{number}", 9.0))
        (command,) = await desk.commander.stop(["AGI"], "ana", desk.clock())
        await settle()
        desk.answer("LATCHED")
        desk.hub.append("problem", None)
        frames = await browser.read_until("problem")

    lines = [one["data"]["id"] for one in frames if one["topic"] == "log"]
    steps = [
        one["data"]["state"]
        for one in frames
        if one["topic"] == f"commands/{command.command_id}"
    ]
    assert lines == [line.id for line in list(desk.event_log.lines)[before:]]
    assert steps == ["REQUESTED", "SENT", "DELIVERED"]


async def test_every_state_topic_beside_telemetry_can_be_told() -> None:
    desk = WebDesk()
    desk.hear(Climate(20.0))
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        told = {}
        for topic in ("alerts", "climate", "health", "flood", "rule"):
            desk.hub.changed(topic)
            told[topic] = (await browser.read_until(topic))[-1]["data"]

    assert told["alerts"] == []
    assert told["climate"]["temperature"] == 20.0
    assert told["health"]["hops"]


async def test_a_topic_with_nothing_to_say_is_not_told() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        desk.hub.changed("climate")
        desk.hub.changed("health")
        frames = await browser.read_until("health")

    assert [one["topic"] for one in frames] == ["health"]


def test_f22_a_version_is_encoded_once_for_all_browsers() -> None:
    desk = WebDesk()

    desk.hear(Climate(20.0))
    first, again = desk.encoder.frame("climate"), desk.encoder.frame("climate")
    desk.hear(Climate(21.0))

    assert first is again
    assert desk.encoder.frame("climate") != first


# --- too slow ---------------------------------------------------------------------


async def test_f23_who_lets_events_pile_up_is_closed_with_4008() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        for number in range(MAX_PENDING + 1):
            desk.hub.append("problem", {"id": number})

        assert await browser.close_code() == 4008


async def test_f23_one_that_is_too_slow_does_not_hold_up_another() -> None:
    desk = WebDesk()
    async with (
        desk.serving() as address,
        looking(desk, address) as slow,
        looking(desk, address) as quick,
    ):
        await slow.read()
        await quick.read()
        for _ in range(200):
            desk.hub.append("problem", "x" * 50_000)
            desk.hub.changed("health")
            await quick.read_until("health")

        assert desk.hub.watchers == 2


class Deaf:
    """A browser's line that takes nothing."""

    async def send_text(self, _: str) -> None:
        """Wait for room, in vain."""
        await asyncio.Event().wait()


async def test_f23_who_does_not_read_what_is_sent_is_noticed_and_who_waits_is_not() -> (
    None
):
    desk = WebDesk()
    told, untold = desk.hub.join(), desk.hub.join()
    lines = [
        Line(Deaf(), each, desk.encoder, desk.clock, limit_s=0.01)  # type: ignore[arg-type]
        for each in (told, untold)
    ]
    feeds = [
        TelemetryFeed(desk.encoder.telemetry, each, Painting(desk.latency.watch))
        for each in (told, untold)
    ]
    sending = [
        asyncio.create_task(line.send(feed))
        for line, feed in zip(lines, feeds, strict=True)
    ]
    told.changed("health")
    async with asyncio.timeout(30):
        while not lines[0].is_stuck:  # noqa: ASYNC110 - nothing tells of it
            await asyncio.sleep(0.005)

    assert not lines[1].is_stuck
    for task in sending:
        task.cancel()
    await asyncio.gather(*sending, return_exceptions=True)


# --- what browsers say ------------------------------------------------------------


async def test_a_ping_is_answered_with_the_servers_time() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        await browser.say(type="ping", t=123.5)
        (pong,) = await browser.read_until("pong")

    assert pong["data"] == {"t": 123.5, "server": desk.clock().wall}


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


async def test_stopping_a_robot_that_is_not_there_is_told_and_the_line_stays() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        await browser.say(type="stop", robot_id="AGX")
        (problem,) = await browser.read_until("problem")
        await browser.say(type="ping", t=1)
        await browser.read_until("pong")

    assert "AGX" in problem["data"]["reason"]


@pytest.mark.parametrize("junk", ["", "{", "[" * 5000, '{"t": NaN}'])
async def test_junk_is_told_and_the_line_stays(junk: str) -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        await browser.socket.send(junk)
        await browser.read_until("problem")
        await browser.say(type="ping", t=1)
        await browser.read_until("pong")


@pytest.mark.parametrize(
    "junk", ["[]", "7", "{}", '{"type": "dance"}', '{"type": "stop", "robot_id": 7}']
)
async def test_what_means_nothing_is_left_alone(junk: str) -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        await browser.socket.send(junk)
        await browser.say(type="ping", t=1)
        await browser.read_until("pong")

    assert desk.fleet.stops == []


async def test_a_revoked_session_can_no_longer_stop() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        desk.authenticator.sessions._sessions.clear()
        await browser.say(type="stop", robot_id="AGI")

        assert await browser.close_code() == 4401
    assert desk.fleet.stops == []


async def test_a_stop_on_a_tablet_has_the_name_of_whoever_holds_it_then() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        sessions = desk.authenticator.sessions
        (digest,) = sessions._sessions
        sessions.make_tablet(Principal("ana", "operator", digest), "Nave 2")
        await browser.say(type="stop", robot_id="AGI")
        await browser.read_until("log")

    (command,) = desk.commander.commands.values()
    assert command.requesters == ("Nave 2",)


async def test_a_new_rule_is_told_to_every_browser() -> None:
    desk = WebDesk()
    async with (
        desk.serving() as address,
        looking(desk, address) as one,
        looking(desk, address) as other,
    ):
        for browser in (one, other):
            await browser.read_until("snapshot")
        wanted = replace(desk.rules.current, radius_m=3.5)
        await desk.rules.change(wanted, "ana", desk.clock())
        rules = [(await each.read_until("rule"))[-1] for each in (one, other)]

    assert [told["data"]["version"] for told in rules] == [2, 2]
    assert [told["data"]["radius_m"] for told in rules] == [3.5, 3.5]


async def test_how_fast_alerts_come_is_told_when_it_changes() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read_until("snapshot")
        desk.drive("AGI")
        await desk.wait(3.2)
        told = (await browser.read_until("flood"))[-1]

    assert told["data"] == {"count": 1, "limit": 10, "window_s": 600.0, "since": None}


async def test_a_mistake_of_ours_is_told_as_an_error_and_ends_that_line(
    caplog: pytest.LogCaptureFixture,
) -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        desk.hub.append("commands/nonsense", object())

        await browser.close_code()

    told = [line for line in caplog.records if "has failed" in line.message]
    assert [line.levelname for line in told] == ["ERROR"]
