"""Issue 13.23: people outside iVeg are told of alerts, and nothing waits for it."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable
from dataclasses import replace

import pytest

from iveg.domain.alerts.stored import read_alert
from iveg.domain.contacts import Contacts, Email, Push, SubscribedBrowser, Webhook
from iveg.domain.events import Condition
from iveg.domain.messages import CHANNELS, AlertItem, Channel
from iveg.domain.records import AlertRecord
from iveg.models.alert import Alert
from iveg.pipeline.messenger import MOST_WAITING, TRIES, Messenger
from tests.builders import START
from tests.fakes.messages import FakeContacts, FakeSender
from tests.unit.pipeline.desk import Desk

GRAVE = Condition("P1", "stop_unconfirmed", "AGI", "AGI", {"robot": "AGI"})
BOTHERSOME = Condition("P2", "battery_low", "AGI", "AGI", {"robot": "AGI"})
EVERYBODY = Contacts(
    Push(on=True), Email(on=True, least="P2"), Webhook(on=True, least="P1")
)


class Outpost:
    """A desk whose alerts are told outside."""

    def __init__(
        self, contacts: Contacts = EVERYBODY, rest_s: float = 0.0, limit_s: float = 5.0
    ) -> None:
        self.desk = Desk()
        self.store = FakeContacts()
        self.senders = {name: FakeSender(name) for name in CHANNELS}
        self.messenger = Messenger(
            contacts,
            self.store,
            {**self.senders},
            self.desk.evaluator.alerts,
            self.desk.event_log,
            self.desk.clock,
            rest_s,
            limit_s,
        )
        self.desk.evaluator.alerts.on_raised = self.messenger.enqueue_raised

    def wrong(self, *conditions: Condition) -> None:
        self.desk.evaluator.alerts.sync(conditions, self.desk.clock())

    def told(self, channel: Channel) -> list[str]:
        return [
            one.key for message in self.senders[channel].sent for one in message.items
        ]

    @contextlib.asynccontextmanager
    async def serving(self) -> AsyncIterator[None]:
        task = asyncio.create_task(self.messenger.run())
        yield
        await turns()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    def alert(self) -> Alert:
        return Alert.of(self.desk.evaluator.alerts.waiting[0])


async def until(is_so: Callable[[], bool]) -> None:
    """Return when something is so; the time-out of a channel runs on a real clock."""
    async with asyncio.timeout(5):
        while not is_so():  # noqa: ASYNC110 - the messenger tells nobody of it
            await asyncio.sleep(0.001)


async def turns(n: int = 50) -> None:
    """Let everything that can go on go on."""
    for _ in range(n):
        await asyncio.sleep(0)


async def test_at_first_nobody_is_told() -> None:
    post = Outpost(Contacts())
    async with post.serving():
        post.wrong(GRAVE, BOTHERSOME)

    assert [post.told(name) for name in CHANNELS] == [[], [], []]


async def test_each_channel_is_told_of_its_priorities_alone() -> None:
    post = Outpost()
    async with post.serving():
        post.wrong(GRAVE, BOTHERSOME)

    assert post.told("push") == ["stop_unconfirmed"]
    assert post.told("email") == ["stop_unconfirmed", "battery_low"]
    assert post.told("webhook") == ["stop_unconfirmed"]


async def test_the_alert_says_who_was_told_and_when_in_the_history_too() -> None:
    post = Outpost(Contacts(email=Email(on=True)))
    async with post.serving():
        post.wrong(GRAVE)

    told = [one.model_dump() for one in post.alert().told]
    at = "2023-11-14T22:13:20.000Z"
    assert told == [{"channel": "email", "to": "Ana", "at": at, "failed": None}]
    record = post.desk.records(AlertRecord)[-1]
    assert isinstance(record, AlertRecord)
    assert [one.model_dump() for one in Alert.of_record(record).told] == told
    again = Alert.of(read_alert(record, post.desk.clock()))
    assert [one.model_dump() for one in again.told] == told


async def test_a_message_names_no_robot_no_person_and_no_place() -> None:
    post = Outpost(Contacts(webhook=Webhook(on=True)))
    async with post.serving():
        post.wrong(replace(GRAVE, slots={"robot": "AGI", "lane": "Pasillo 3"}))

    (message,) = post.senders["webhook"].sent
    assert set(AlertItem.__slots__) == {
        "alert_id",
        "priority",
        "key",
        "raised",
        "tries",
    }
    assert "AGI" not in json.dumps([one.key for one in message.items])


async def test_what_came_meanwhile_is_one_message() -> None:
    post = Outpost(Contacts(webhook=Webhook(on=True)), rest_s=3600.0)
    async with post.serving():
        post.wrong(*(replace(GRAVE, subject=str(n)) for n in range(7)))

    assert [len(one.items) for one in post.senders["webhook"].sent] == [7]


async def test_a_flood_waits_for_the_rest_and_its_oldest_gives_way() -> None:
    post = Outpost(Contacts(webhook=Webhook(on=True)), rest_s=3600.0)
    async with post.serving():
        post.wrong(GRAVE)
        await turns()
        post.wrong(*(replace(GRAVE, subject=str(n)) for n in range(MOST_WAITING + 5)))

    assert len(post.senders["webhook"].sent) == 1
    assert post.messenger.counters["messages.dropped"] == 5


async def test_who_was_not_reached_is_tried_again_and_then_no_more() -> None:
    post = Outpost(Contacts(webhook=Webhook(on=True)))
    post.senders["webhook"].failing = "no_answer"
    async with post.serving():
        post.wrong(GRAVE)
        await turns(200)

    assert len(post.senders["webhook"].sent) == TRIES
    assert [one.failed for one in post.alert().told] == ["no_answer"]
    assert post.messenger.counters["messages.failed.webhook"] == TRIES


@pytest.mark.parametrize(
    ("broken", "hangs", "why"),
    [(True, False, "internal"), (False, True, "no_answer")],
)
async def test_a_channel_that_fails_or_hangs_stops_no_other(
    broken: bool, hangs: bool, why: str
) -> None:
    post = Outpost(limit_s=0.01)
    post.senders["email"].broken, post.senders["email"].hangs = broken, hangs
    async with post.serving():
        post.wrong(GRAVE)
        await until(lambda: post.messenger.counters["messages.failed.email"] > 0)

    assert post.told("push") == ["stop_unconfirmed"]
    assert why in {one.failed for one in post.alert().told}


async def test_a_stop_goes_out_while_every_channel_hangs() -> None:
    post = Outpost()
    for sender in post.senders.values():
        sender.hangs = True
    async with post.serving():
        post.wrong(GRAVE)
        await turns()
        await post.desk.commander.stop(["AGI"], "ana", post.desk.clock())

    assert [robot for robot, _ in post.desk.fleet.stops] == ["AGI"]


async def test_a_test_reaches_a_channel_that_is_off() -> None:
    post = Outpost(Contacts())

    told = await post.messenger.test("email")

    assert [(one.to, one.failed) for one in told] == [("Ana", None)]
    assert post.senders["email"].sent[0].is_test


async def test_a_browser_that_has_gone_is_forgotten() -> None:
    device = SubscribedBrowser(
        "D1", "Ana", "https://push.example/1", "", "", "es", START.wall
    )
    post = Outpost(Contacts(Push(on=True, devices=(device,))))
    post.senders["push"].failing, post.senders["push"].device_id = "gone", "D1"
    async with post.serving():
        post.wrong(GRAVE)

    assert post.messenger.contacts.push.devices == ()
    assert post.store.saved[-1].push.devices == ()
