"""People outside iVeg are told of alerts, and nothing waits for it."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, field, replace

import pytest

from iveg.comfort.messenger import MOST_WAITING, Messenger
from iveg.domain.events import Address, AlertItem, Condition, MessagePlan, MessageText
from tests.unit.vital.desk import Desk

GRAVE = Condition("P1", "stop_unconfirmed", "AGI", "AGI", {"robot": "AGI"})
BOTHERSOME = Condition("P2", "battery_low", "AGI", "AGI", {"robot": "AGI"})
ANA = Address("Ana", "json://ana/secret")
EVA = Address("Eva", "json://eva/secret", "P2")
GUARD = Address("Guard", "json://guard/secret", "P2", escalates=True)


@dataclass
class Way:
    """Keeps what was sent; ``failing`` says why not, ``hung`` never answer."""

    failing: str | None = None
    error: Exception | None = None
    hung: frozenset[str] = frozenset()
    sent: list[tuple[str, str]] = field(default_factory=list)

    async def send(self, to: Address, text: MessageText) -> str | None:
        self.sent.append((to.name, text.body))
        if to.name in self.hung:
            await asyncio.Event().wait()
        if self.error:
            raise self.error
        return self.failing

    def to(self, address: Address) -> list[str]:
        return [body for name, body in self.sent if name == address.name]


def write(items: Sequence[AlertItem], is_escalated: bool) -> MessageText:
    how = "late" if is_escalated else "new"
    return MessageText(how, " ".join(one.priority for one in items))


class Outpost:
    """A desk whose alerts leave the house."""

    def __init__(
        self, *addresses: Address, rest_s: float = 0.0, limit_s: float = 5.0
    ) -> None:
        self.desk, self.way = Desk(), Way()
        self.alerts = self.desk.evaluator.alerts
        self.messenger = Messenger(
            MessagePlan(addresses, escalate_after_s=300.0),
            self.way,
            write,
            lambda: self.alerts.waiting,
            self.desk.clock,
        )
        self.messenger.rest_s, self.messenger.limit_s = rest_s, limit_s
        self.alerts.on_raised = self.messenger.enqueue_raised

    def wrong(self, *conditions: Condition) -> None:
        self.alerts.sync(conditions, self.desk.clock())

    def later(self, seconds: float) -> None:
        self.desk.clock.now += seconds
        self.messenger.escalate()

    @contextlib.asynccontextmanager
    async def serving(self) -> AsyncIterator[None]:
        task = asyncio.create_task(self.messenger.run())
        yield
        await turns()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def turns(n: int = 50) -> None:
    """Let everything that can go on go on."""
    for _ in range(n):
        await asyncio.sleep(0)


async def until(is_so: Callable[[], bool]) -> None:
    """Return when something is so; the time-out of an address runs on a real clock."""
    async with asyncio.timeout(5):
        while not is_so():  # noqa: ASYNC110 - the messenger tells nobody of it
            await asyncio.sleep(0.001)


async def test_each_address_gets_its_priorities_alone() -> None:
    post = Outpost(ANA, EVA, GUARD)
    async with post.serving():
        post.wrong(GRAVE, BOTHERSOME)

    assert (post.way.to(ANA), post.way.to(EVA)) == (["P1"], ["P1 P2"])
    assert post.way.to(GUARD) == []


async def test_what_nobody_acknowledged_goes_to_the_second_list_once() -> None:
    post = Outpost(GUARD)
    async with post.serving():
        post.wrong(GRAVE)
        post.later(0.0)
        post.later(299.0)
        await turns()
        assert post.way.sent == []
        post.later(1.0)
        await turns()
        post.later(900.0)

    assert post.way.to(GUARD) == ["P1"]


async def test_a_p1_that_comes_and_goes_is_escalated_all_the_same() -> None:
    post = Outpost(GUARD)
    async with post.serving():
        for _ in range(8):
            post.wrong(GRAVE)
            post.later(20.0)
            post.wrong()
            post.later(20.0)

    assert post.way.to(GUARD) == ["P1"]


async def test_what_somebody_acknowledged_is_not_escalated() -> None:
    post = Outpost(GUARD)
    async with post.serving():
        post.wrong(GRAVE)
        post.later(0.0)
        (alert,) = post.alerts.waiting
        post.alerts.acknowledge(alert.alert_id, "ana", "", post.desk.clock())
        post.later(900.0)

    assert post.way.sent == []


async def test_what_came_meanwhile_is_one_message_and_the_oldest_gives_way() -> None:
    post = Outpost(ANA, rest_s=3600.0)
    async with post.serving():
        post.wrong(GRAVE)
        await turns()
        post.wrong(*(replace(GRAVE, subject=str(n)) for n in range(MOST_WAITING + 5)))

    assert post.way.to(ANA) == ["P1"]
    assert post.messenger.counters["messages.dropped"] == 5


async def test_what_was_not_taken_is_sent_later(
    caplog: pytest.LogCaptureFixture,
) -> None:
    post = Outpost(ANA)
    post.way.failing = "not taken"
    async with post.serving():
        post.wrong(GRAVE)
        await turns()
        tries = post.messenger.counters["messages.failed"]
        assert tries > 1
        assert caplog.messages == ["messages to Ana fail: not taken"]
        post.way.failing = None
        await turns()
        sent = len(post.way.sent)

    assert len(post.way.sent) == sent
    assert post.messenger.counters["messages.sent"] == 1


async def test_a_message_that_breaks_is_logged_without_its_text(
    caplog: pytest.LogCaptureFixture,
) -> None:
    post = Outpost(ANA)
    post.way.error = RuntimeError(ANA.url)
    caplog.set_level(logging.DEBUG)
    async with post.serving():
        post.wrong(GRAVE)

    assert caplog.messages.count("messages to Ana fail: RuntimeError") == 1
    assert "secret" not in caplog.text


async def test_an_address_that_hangs_holds_up_no_other_and_no_stop() -> None:
    post = Outpost(ANA, EVA, limit_s=0.01)
    post.way.hung = frozenset({"Ana"})
    async with post.serving():
        post.wrong(GRAVE)
        await until(lambda: post.messenger.counters["messages.failed"] == 1)
        await post.desk.commander.stop(["AGI"], "ana", post.desk.clock())

    assert post.way.to(EVA) == ["P1"]
    assert [robot for robot, _ in post.desk.fleet.stops] == ["AGI"]
