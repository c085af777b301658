"""Messages to browsers by their push services.

Sent by RFC 8030; ``push_encryption`` encrypts and signs.
"""

import asyncio
from collections.abc import Sequence

import orjson

from iveg.adapters.mail import Write
from iveg.adapters.outbound import OutboundHttp
from iveg.adapters.push_encryption import decode, encrypted, signed
from iveg.domain.contacts import Contacts, Push, SubscribedBrowser
from iveg.domain.errors import OutboundError
from iveg.domain.messages import MessageDelivery, OutboundMessage
from iveg.domain.observations import Instant

_LIVES_S = 3600
"""A push service keeps a message for a device that is off for an hour, no longer."""
_GONE = (404, 410)


class PushSender:
    """Sends to every browser that asked for it."""

    def __init__(self, outside: OutboundHttp, write: Write) -> None:
        self._outbound = outside
        self._write = write

    async def send(
        self, contacts: Contacts, message: OutboundMessage, now: Instant
    ) -> Sequence[MessageDelivery]:
        """One push a device, all at once."""
        push = contacts.push
        return await asyncio.gather(
            *(self._one(push, device, message, now) for device in push.devices)
        )

    async def _one(
        self,
        push: Push,
        device: SubscribedBrowser,
        message: OutboundMessage,
        now: Instant,
    ) -> MessageDelivery:
        text = self._write(message, device.language)
        content = orjson.dumps({"title": text.title, "body": text.body})
        try:
            status = await self._outbound.post(
                device.endpoint,
                encrypted(content, decode(device.p256dh), decode(device.auth)),
                {
                    "Authorization": signed(device.endpoint, push, now.wall),
                    "Content-Encoding": "aes128gcm",
                    "Content-Type": "application/octet-stream",
                    "TTL": str(_LIVES_S),
                    "Urgency": "high",
                },
            )
            failed = _failed(status)
        except OutboundError as error:
            failed = error.why
        except ValueError:
            failed = "gone"  # the browser sent no valid key: it cannot be reached
        return MessageDelivery("push", device.who, now, failed, device.device_id)


def _failed(status: int) -> str | None:
    if status in _GONE:
        return "gone"
    return None if 200 <= status < 300 else "refused"
