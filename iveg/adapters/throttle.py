"""Throttles Orion's copies of odometry and scans while the direct ones are fresh.

``domain.feeds`` decides; here are the changes at Orion.  The robots' entities are read
once after every switch: throttling drops the last value, and nothing is notified when a
subscription changes.
"""

import asyncio
from collections.abc import Awaitable, Callable, Mapping

from iveg.adapters.mqtt import MqttLink
from iveg.adapters.subscriptions import (
    SubscriptionStore,
    is_throttled,
    write_subscription,
)
from iveg.adapters.wanted_subscriptions import THROTTLING_S, WantedSubscription
from iveg.domain.errors import HopError
from iveg.domain.feeds import Feeds
from iveg.domain.observations import Instant

_LOOKS_EVERY_S, _AGAIN_S = 0.2, 1.0
_AT_ONCE = 10


class Throttle:
    """Switches each copy between full and one a second.

    Args:
        reread: Reads all entities; raises HopError.

    Attributes:
        copies: Id of each subscription that may be throttled, and whether it is.
        ids: The copies' subscriptions.
        switches: How often something was switched.
        allowed: Whether anything may be throttled at all.
    """

    def __init__(
        self,
        orion: SubscriptionStore,
        link: MqttLink,
        feeds: Feeds,
        notify_url: str,
        notify_token: str,
        read_clock: Callable[[], Instant],
        reread: Callable[[], Awaitable[None]],
    ) -> None:
        self._orion = orion
        self._link = link
        self._feeds = feeds
        self._notify_url = notify_url
        self._notify_token = notify_token
        self._clock = read_clock
        self._reread = reread
        self._must_read = False
        self._thinned: frozenset[str] = frozenset()
        self.ids: frozenset[str] = frozenset()
        self.copies: dict[WantedSubscription, tuple[str, bool]] = {}
        self.switches = 0
        self.allowed = True

    def found(
        self, copies: Mapping[WantedSubscription, tuple[str, bool]], switches: int = 0
    ) -> None:
        """Take the state at Orion, unless something was switched since then."""
        if switches == self.switches:
            self.copies = dict(copies)
            self._index()

    def _index(self) -> None:
        """Asked for each notification; the copies change once in minutes."""
        known = self.copies.values()
        self.ids = frozenset(one for one, _ in known)
        self._thinned = frozenset(one for one, throttled in known if throttled)

    def is_throttled(self, subscription_id: str) -> bool:
        """Whether what this subscription brings is only now and then."""
        return subscription_id in self._thinned

    async def run(self) -> None:
        """Until cancelled; the watcher of Orion reports failures."""
        while True:
            await asyncio.sleep(_LOOKS_EVERY_S)
            try:
                await self.check()
            except (HopError, AttributeError, KeyError, TypeError, ValueError):
                # It is down, or answered JSON that means nothing here.
                await asyncio.sleep(_AGAIN_S)

    async def check(self) -> None:
        """Switch every copy that must be switched.

        Raises:
            HopError: Orion did not do it.
        """
        if changes := self._changes():
            self._must_read = True
            self.switches += 1
            await self._switch_all(changes)
            await self._verify(changes)
        if self._must_read:
            await self._reread()
            self._must_read = False

    def _changes(self) -> dict[WantedSubscription, bool]:
        # Before the first connection nobody knows how the direct transport does.
        connected = self._link.connected or not self._link.connects
        now = self._clock().mono
        changes = {}
        for want, (_, throttled) in self.copies.items():
            assert want.copied is not None  # noqa: S101 - all of these are copies
            wish = self._feeds.of(*want.copied).judge(now, connected=connected)
            if wish is not None and (wish and self.allowed) != throttled:
                changes[want] = wish and self.allowed
        return changes

    async def _switch_all(self, changes: Mapping[WantedSubscription, bool]) -> None:
        """Switch a few at a time: one by one would take as long as the overload lasts.

        Raises:
            HopError: Orion did not do one of them; it is tried again.
        """
        waiting = list(changes.items())
        while waiting:
            now, waiting = waiting[:_AT_ONCE], waiting[_AT_ONCE:]
            done = await asyncio.gather(
                *(self._switch(want, throttled) for want, throttled in now),
                return_exceptions=True,
            )
            for error in filter(None, done):
                raise error

    async def _switch(self, want: WantedSubscription, throttled: bool) -> None:
        known, _ = self.copies[want]
        seconds = THROTTLING_S if throttled else 0
        await self._orion.update_subscription(known, {"throttling": seconds})
        self.copies[want] = known, throttled
        self._index()

    async def _verify(self, changes: Mapping[WantedSubscription, bool]) -> None:
        """An Orion that takes the change and does nothing gets a new subscription."""
        stands = {one["id"]: one for one in await self._orion.read_subscriptions()}
        for want, throttled in changes.items():
            known, _ = self.copies[want]
            if known in stands and is_throttled(stands[known]) != throttled:
                await self._renew(want, known, throttled)

    async def _renew(
        self, want: WantedSubscription, known: str, throttled: bool
    ) -> None:
        document = write_subscription(want, self._notify_url, self._notify_token)
        if throttled:
            document["throttling"] = THROTTLING_S
        made = await self._orion.create_subscription(document)
        self.copies[want] = made, throttled
        self._index()
        await self._orion.delete_subscription(known)
