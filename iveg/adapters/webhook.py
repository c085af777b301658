"""Messages as JSON to an https address (docs/interfaces/http.md, "Messages")."""

from collections.abc import Sequence

import orjson

from iveg.adapters.outbound import OutboundHttp
from iveg.domain.contacts import Contacts
from iveg.domain.errors import OutboundError
from iveg.domain.messages import MessageDelivery, OutboundMessage
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp

_HEADERS = {"Content-Type": "application/json", "User-Agent": "iVeg"}


class WebhookSender:
    """Posts each message once."""

    def __init__(self, outside: OutboundHttp) -> None:
        self._outbound = outside

    async def send(
        self, contacts: Contacts, message: OutboundMessage, now: Instant
    ) -> Sequence[MessageDelivery]:
        """Post to the address, where there is one."""
        hook = contacts.webhook
        if not hook.url:
            return []
        body = orjson.dumps(body_of(message, now))
        try:
            status = await self._outbound.post(hook.url, body, _HEADERS)
        except OutboundError as error:
            return [MessageDelivery("webhook", hook.who, now, error.why)]
        failed = None if 200 <= status < 300 else "refused"
        return [MessageDelivery("webhook", hook.who, now, failed)]


def body_of(message: OutboundMessage, now: Instant) -> dict[str, object]:
    """Body for a program: priority, kind, time; no more."""
    return {
        "iveg": "test" if message.is_test else "alert",
        "sent_at": format_stamp(now.wall),
        "priority": None if message.is_test else message.priority,
        "alerts": [
            {
                "alert_id": one.alert_id,
                "priority": one.priority,
                "key": one.key,
                "raised_at": format_stamp(one.raised.wall),
            }
            for one in message.items
        ],
    }
