"""Orion is told to leave copies out, and to bring them all again."""

from collections.abc import Mapping
from typing import Any

import pytest

from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.mqtt import MqttLink
from iveg.adapters.orion import OrionClient
from iveg.adapters.subscriptions import ensure_subscriptions
from iveg.adapters.throttle import Throttle
from iveg.adapters.wanted_subscriptions import wanted_for
from iveg.domain.errors import HopError
from iveg.domain.feeds import Feeds
from iveg.domain.observations import LaserScan, Odometry
from iveg.domain.transports import DIRECT, FIWARE
from iveg.lab.embedded.server import embedded_fiware
from tests.fakes.clock import FakeClock
from tests.unit.adapters.test_subscriptions import FakeStore

URL = "http://127.0.0.1:8000/ngsi/notifications"
TOKEN = "ab" * 16
ROBOTS = ("AGI", "AGII")
WANTED = wanted_for(ROBOTS)


class StubbornStore(FakeStore):
    """Takes a change of the throttling and does nothing."""

    async def update_subscription(
        self, subscription_id: str, changes: Mapping[str, Any]
    ) -> None:
        kept = {part: value for part, value in changes.items() if part != "throttling"}
        await super().update_subscription(subscription_id, kept)


class Bench:
    """A throttle over a store, with the feeds of two robots."""

    def __init__(self, store: FakeStore | None = None) -> None:
        self.store = store or FakeStore()
        self.clock = FakeClock()
        self.feeds = Feeds()
        self.reads = 0
        self.refuses_to_read = False
        self.throttle = Throttle(
            self.store,
            MqttLink(BrokerAddress("127.0.0.1", 9), "test"),
            self.feeds,
            URL,
            TOKEN,
            self.clock,
            self._read,
        )

    async def _read(self) -> None:
        self.reads += 1
        if self.refuses_to_read:
            raise HopError("orion", "cannot be reached")

    async def found(self) -> "Bench":
        done = await ensure_subscriptions(self.store, URL, TOKEN, WANTED)
        self.throttle.found(done.copies, self.throttle.switches)
        return self

    def hear(self, seconds: float, *, direct: tuple[str, ...] = ROBOTS) -> None:
        for _ in range(round(seconds * 10)):
            self.clock.now += 0.1
            now = self.clock().mono
            for robot_id in ROBOTS:
                for kind in (Odometry, LaserScan):
                    feed = self.feeds.of(robot_id, kind)
                    if robot_id in direct:
                        feed.heard(DIRECT.id, now, news=True)
                    feed.heard(FIWARE.id, now, news=robot_id not in direct)

    def throttled(self) -> set[str]:
        return {
            one["description"]
            for one in self.store.kept.values()
            if one.get("throttling")
        }


COPIES = {
    f"iVeg: {kind} {robot_id}" for kind in ("odometry", "lidar") for robot_id in ROBOTS
}


async def test_only_copies_of_odometry_and_scans_are_throttled() -> None:
    bench = await Bench().found()
    bench.hear(6.0)
    await bench.throttle.check()
    assert bench.throttled() == COPIES
    assert {one.get("throttling", 0) for one in bench.store.kept.values()} == {0, 1}


async def test_the_robot_whose_direct_copy_is_lost_gets_all_of_orions() -> None:
    bench = await Bench().found()
    bench.hear(6.0)
    await bench.throttle.check()
    bench.hear(1.5, direct=("AGII",))
    await bench.throttle.check()
    assert bench.throttled() == {"iVeg: odometry AGII", "iVeg: lidar AGII"}


async def test_every_switch_reads_the_entities_once() -> None:
    bench = await Bench().found()
    await bench.throttle.check()
    bench.hear(6.0)
    for _ in range(3):
        await bench.throttle.check()
    assert bench.reads == 1


async def test_a_read_that_failed_is_done_at_the_next_look() -> None:
    bench = await Bench().found()
    bench.hear(6.0)
    bench.refuses_to_read = True
    with pytest.raises(HopError):
        await bench.throttle.check()
    bench.refuses_to_read = False
    await bench.throttle.check()
    await bench.throttle.check()
    assert bench.reads == 2


async def test_a_restart_takes_what_stands_and_changes_nothing() -> None:
    before = await Bench().found()
    before.hear(6.0)
    await before.throttle.check()
    calls = before.store.calls

    after = await Bench(before.store).found()
    await after.throttle.check()

    assert after.store.calls == calls
    assert after.throttled() == COPIES
    assert all(after.throttle.is_throttled(one) for one in after.throttle.ids)


async def test_a_restart_without_a_direct_copy_brings_all_again() -> None:
    before = await Bench().found()
    before.hear(6.0)
    await before.throttle.check()

    after = await Bench(before.store).found()
    after.hear(1.5, direct=())
    await after.throttle.check()

    assert after.throttled() == set()


async def test_an_orion_that_ignores_the_change_gets_new_subscriptions() -> None:
    bench = await Bench(StubbornStore()).found()
    others = set(bench.store.kept) - bench.throttle.ids
    bench.hear(6.0)
    await bench.throttle.check()
    assert bench.throttled() == COPIES
    assert set(bench.store.kept) == others | bench.throttle.ids
    bench.hear(1.5, direct=())
    await bench.throttle.check()
    assert bench.throttled() == set()
    assert len(bench.store.kept) == len(WANTED)


async def test_what_was_listed_before_a_switch_is_not_believed_after_it() -> None:
    bench = await Bench().found()
    listed, switches = dict(bench.throttle.copies), bench.throttle.switches
    bench.hear(6.0)
    await bench.throttle.check()
    bench.throttle.found(listed, switches)
    assert all(throttled for _, throttled in bench.throttle.copies.values())


async def test_the_embedded_orion_switches_both_ways_by_a_change() -> None:
    async with (
        embedded_fiware() as up,
        OrionClient(up.orion_url, "agroconnect", "/greenhouse") as orion,
    ):
        done = await ensure_subscriptions(orion, URL, TOKEN, WANTED)
        ((known, _), *_) = done.copies.values()
        said = []
        for seconds in (1, 0):
            await orion.update_subscription(known, {"throttling": seconds})
            kept = {one["id"]: one for one in await orion.read_subscriptions()}
            said.append(kept[known].get("throttling"))
    assert said == [1, None]


async def test_nothing_is_throttled_where_that_is_not_allowed() -> None:
    bench = await Bench().found()
    bench.throttle.allowed = False
    bench.hear(6.0)
    await bench.throttle.check()
    assert bench.throttled() == set()
    assert bench.reads == 0


async def test_what_an_earlier_run_throttled_is_let_go_where_that_is_not_allowed() -> (
    None
):
    bench = await Bench().found()
    bench.hear(6.0)
    await bench.throttle.check()
    bench.throttle.allowed = False
    await bench.throttle.check()
    assert bench.throttled() == set()
