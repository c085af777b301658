"""Channels that keep what they were given, and a store of contacts in memory."""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field

from iveg.domain.contacts import Contacts
from iveg.domain.errors import HopError
from iveg.domain.messages import Channel, MessageDelivery, OutboundMessage
from iveg.domain.observations import Instant


class FakeContacts:
    """Keeps what is saved; ``full`` refuses."""

    def __init__(self) -> None:
        self.saved: list[Contacts] = []
        self.full = False

    async def save(self, contacts: Contacts) -> None:
        if self.full:
            raise HopError("disk", "no space left")
        self.saved.append(contacts)


@dataclass
class FakeSender:
    """Reaches Ana; ``failing`` says why not, ``broken`` raises, ``hangs`` hangs."""

    channel: Channel
    failing: str | None = None
    broken: bool = False
    hangs: bool = False
    device_id: str | None = None
    sent: list[OutboundMessage] = field(default_factory=list)

    async def send(
        self, contacts: Contacts, message: OutboundMessage, now: Instant
    ) -> Sequence[MessageDelivery]:
        assert isinstance(contacts, Contacts)
        self.sent.append(message)
        if self.hangs:
            await asyncio.Event().wait()
        if self.broken:
            raise RuntimeError("a fault of ours")
        return [MessageDelivery(self.channel, "Ana", now, self.failing, self.device_id)]
