"""The WebSocket with ``iveg.2`` over a real server: credit holds telemetry alone."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

import orjson
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from iveg.web.live.pacing import BYTES, FRAMES, SUBPROTOCOL
from tests.builders import detection, scan
from tests.unit.pipeline.desk import settle
from tests.unit.web.desk import WebDesk

PACED = [Subprotocol(SUBPROTOCOL)]


class Page:
    """One connection: telemetry apart from what passes beside it, both in order."""

    def __init__(self, line: ClientConnection) -> None:
        self.line = line
        self.telemetry: list[dict[str, Any]] = []
        self.bytes = 0
        self.others: list[dict[str, Any]] = []

    async def read(self) -> None:
        """The next message, whatever it is."""
        async with asyncio.timeout(30):
            message = await self.line.recv()
        if isinstance(message, str):
            self.others.append(orjson.loads(message))
            return
        end = 4 + int.from_bytes(message[:4], "little")
        self.telemetry.append(orjson.loads(message[4:end]))
        self.bytes += len(message)

    async def read_until(self, topic: str) -> None:
        """Everything up to the first of a topic that is no telemetry."""
        while not self.others or self.others[-1]["topic"] != topic:
            await self.read()

    async def read_frame(self) -> dict[str, Any]:
        """Everything up to the next frame of telemetry."""
        count = len(self.telemetry)
        while len(self.telemetry) == count:
            await self.read()
        return self.telemetry[-1]

    async def answer(self, word: object, **more: object) -> None:
        await self.line.send(orjson.dumps({"type": word, **more}).decode())

    async def paint(self) -> None:
        """Say that the newest frame was painted."""
        await self.answer("painted", frame=self.telemetry[-1]["frame"])

    def told(self, topic: str) -> list[Any]:
        return [one["data"] for one in self.others if one["topic"] == topic]


@contextlib.asynccontextmanager
async def looking(desk: WebDesk, address: str) -> AsyncIterator[Page]:
    async with connect(
        f"ws://{address}/live",
        additional_headers=desk.cookie(),
        origin=Origin(f"http://{address}"),
        subprotocols=PACED,
        close_timeout=0.2,
    ) as line:
        assert line.subprotocol == SUBPROTOCOL
        page = Page(line)
        await page.read_until("snapshot")
        yield page


def xs(page: Page) -> list[float]:
    """Where AGI was, in the order in which the page was told."""
    moves = (move for frame in page.telemetry for move in frame["moves"])
    return [move[3] for move in moves if move[0] == "AGI"]


async def drive_on(desk: WebDesk, numbers: range) -> None:
    """AGI moves, time passes, and tasks get their turn."""
    for number in numbers:
        desk.drive("AGI", float(number))
        desk.hear(scan(origin=desk.next_origin()))
        desk.clock.now += 0.02
        await asyncio.sleep(0)


async def test_a_page_that_never_answers_gets_one_window_and_everything_else() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as page:
        before = len(desk.event_log.lines)
        for number in range(FRAMES):
            await drive_on(desk, range(number, number + 1))
            await page.read_frame()
        for number in range(300):
            await drive_on(desk, range(number, number + 1))
            desk.look("AGI", detection(f"thing-{number}", 9.0))
        (command,) = await desk.commander.stop(["AGI"], "ana", desk.clock())
        await settle()
        desk.answer("LATCHED")
        desk.hub.append("problem", None)
        await page.read_until("problem")

    lines = [line.id for line in list(desk.event_log.lines)[before:]]
    steps = page.told(f"commands/{command.command_id}")
    assert [one["frame"] for one in page.telemetry] == list(range(1, FRAMES + 1))
    assert page.bytes <= 2 * BYTES
    assert [line["id"] for line in page.told("log")] == lines
    assert [step["state"] for step in steps] == ["REQUESTED", "SENT", "DELIVERED"]


async def test_a_page_that_answers_late_is_told_the_newest_and_nothing_between() -> (
    None
):
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as page:
        for number in range(FRAMES):
            await drive_on(desk, range(number, number + 1))
            await page.read_frame()
        await drive_on(desk, range(100, 200))
        await page.paint()
        await page.read_frame()

    assert xs(page) == [*map(float, range(FRAMES)), 199.0]


async def test_a_ping_an_alert_and_health_pass_a_window_that_is_full() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as page:
        for number in range(FRAMES):
            await drive_on(desk, range(number, number + 1))
            await page.read_frame()
        await page.answer("ping", t=1)
        await page.read_until("pong")
        for topic in ("alerts", "rule", "health"):
            desk.hub.changed(topic)
            await page.read_until(topic)

    assert len(page.telemetry) == FRAMES


async def test_everything_says_when_it_was_true_on_one_clock() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as page:
        desk.clock.now += 5.0
        desk.drive("AGI")
        frame = await page.read_frame()
        await page.answer("ping", t=1)
        await page.read_until("pong")

    now = desk.clock().mono
    ages = [now - one["at"] for one in page.others if one["topic"] in ("log", "pong")]
    assert now - page.others[0]["at"] == 5.0
    assert set(ages) == {0.0}
    assert frame["moves"][0][1] == now


async def test_junk_about_painting_is_left_alone() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as page:
        desk.drive("AGI")
        await page.read_frame()
        for junk in (99, -1, "1", None, [1], True):
            await page.answer("painted", frame=junk)
        await page.answer("ping", t=1)
        await page.read_until("pong")

    assert page.told("problem") == []


async def test_a_new_rule_is_followed_by_the_rings_that_it_draws() -> None:
    desk = WebDesk()
    desk.drive("AGII")
    desk.look("AGII", detection("farmer", 1.0))
    async with desk.serving() as address, looking(desk, address) as page:
        wanted = replace(desk.rules.current, radius_m=3.5)
        await desk.rules.change(wanted, "ana", desk.clock())
        radius_m = None
        while radius_m != 3.5:
            frame = await page.read_frame()
            await page.paint()
            [radius_m] = [
                person["radius_m"]
                for part in frame["parts"]
                if part["topic"] == "people"
                for person in part["data"]["changed"]
            ] or [radius_m]

    assert [told["radius_m"] for told in page.told("rule")] == [3.5]


async def test_who_does_not_ask_is_closed_with_4406() -> None:
    desk = WebDesk()
    async with (
        desk.serving() as address,
        connect(
            f"ws://{address}/live",
            additional_headers=desk.cookie(),
            origin=Origin(f"http://{address}"),
        ) as line,
    ):
        await line.wait_closed()

    assert (line.subprotocol, line.close_code) == (None, 4406)
    assert desk.hub.watchers == 0
