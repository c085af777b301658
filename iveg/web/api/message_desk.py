"""What the routes of messages do with people to be told."""

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, field

from fastapi import HTTPException, Response

from iveg.adapters import push_encryption
from iveg.adapters.public_addresses import is_public_target
from iveg.domain import contacts, messages
from iveg.domain.contacts import Contacts
from iveg.domain.messages import Channel
from iveg.models.alert import Told
from iveg.models.messages import Messages, MessageTest
from iveg.pipeline.messenger import Messenger
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.message_bodies import DeviceBody
from iveg.web.security.roles import Principal

TEST_REST_S = 5.0
"""Between two tests: nobody sends mail or looks for servers with them."""


@dataclass(slots=True)
class Desk:
    """What the routes do with people to be told.

    Attributes:
        messenger: Keeps recipients and sends messages.
        new_id: Names a device.
        clock: The time.
    """

    messenger: Messenger
    new_id: Callable[[], str]
    clock: Clock
    _testing: asyncio.Lock = field(default_factory=asyncio.Lock, init=False)
    _tested_at: float = field(default=-math.inf, init=False)

    @property
    def contacts(self) -> Contacts:
        """Everybody as of now."""
        return self.messenger.contacts

    def answer(self) -> Response:
        """All of it, as operators read it."""
        key = self.contacts.push.key
        public = push_encryption.public_key(key) if key else None
        last, counts = self.messenger.last, self.messenger.counters
        return Json(Messages.of(self.contacts, public, last, counts))

    async def change(
        self, channel: Channel, who: Principal, update: Callable[[Contacts], Contacts]
    ) -> Response:
        """On disk, in force, in the log."""
        await self.messenger.change(update, channel, who.name)
        return self.answer()

    def check(self, body: DeviceBody) -> None:
        """Refuse a browser that cannot be told.

        Raises:
            HTTPException: why it cannot.
        """
        push = self.contacts.push
        if not push.key:
            raise HTTPException(422, "Web push was never on here.")
        if len(others(push, body.endpoint)) >= messages.MOST_DEVICES:
            raise HTTPException(422, "There are as many devices as can be told.")
        is_key = push_encryption.is_public_key(body.keys.p256dh)
        if not is_key or not is_public_target(body.endpoint):
            raise HTTPException(
                422, "That is no subscription of a public push service."
            )

    async def test(self, channel: Channel) -> Response:
        """Send a test: one at a time, and seldom."""
        now = self.clock().mono
        if self._testing.locked() or now - self._tested_at < TEST_REST_S:
            headers = {"Retry-After": str(int(TEST_REST_S))}
            raise HTTPException(429, "One test at a time.", headers)
        async with self._testing:
            self._tested_at = now
            deliveries = await self.messenger.test(channel)
        if not deliveries:
            raise HTTPException(409, "Nobody is to be told by this channel.")
        return Json(MessageTest(told=[Told.of(one) for one in deliveries]))


def others(push: contacts.Push, endpoint: str) -> list[contacts.SubscribedBrowser]:
    """All browsers but that of one endpoint."""
    return [one for one in push.devices if one.endpoint != endpoint]
