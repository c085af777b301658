"""Recipients outside iVeg, as an operator reads them: no password and no key."""

from collections.abc import Mapping, Sequence
from urllib.parse import urlsplit

from pydantic import Field

from iveg.domain import contacts, messages
from iveg.domain.contacts import Contacts
from iveg.domain.messages import Channel, MessageDelivery
from iveg.domain.stamps import format_stamp
from iveg.models.alert import Told
from iveg.models.base import Model


class PushDevice(Model):
    """One browser that receives push messages."""

    device_id: str
    who: str
    language: messages.Language
    since: str


class PushChannel(Model):
    """Web push; ``public_key`` is null until it was on once."""

    on: bool
    contact: str
    public_key: str | None
    devices: list[PushDevice]
    last: list[Told] = Field(
        description="Result of the newest message for each recipient."
    )


class Recipient(Model):
    """Somebody with an address."""

    who: str
    address: str


class EmailChannel(Model):
    """Mail; its password is never told."""

    on: bool
    server: str
    port: int
    security: str
    user: str
    has_password: bool
    sender: str
    recipients: list[Recipient]
    least: messages.Level
    language: messages.Language
    last: list[Told]


class WebhookChannel(Model):
    """The webhook; of its secret address only the host is shown, null without one."""

    on: bool
    who: str
    host: str | None
    least: messages.Level
    last: list[Told]


class Messages(Model):
    """Channels to recipients outside iVeg, with their results."""

    push: PushChannel
    email: EmailChannel
    webhook: WebhookChannel
    counts: dict[str, int] = Field(
        description="``sent.email`` and so on, since the start."
    )

    @classmethod
    def of(
        cls,
        contacts: Contacts,
        public_key: str | None,
        last: Mapping[Channel, Sequence[MessageDelivery]],
        counts: Mapping[str, int],
    ) -> "Messages":
        """As it stands."""
        sent = {
            channel: [Told.of(one) for one in last.get(channel, ())]
            for channel in messages.CHANNELS
        }
        return cls(
            push=_push(contacts.push, public_key, sent["push"]),
            email=_email(contacts.email, sent["email"]),
            webhook=_webhook(contacts.webhook, sent["webhook"]),
            counts={
                name.removeprefix("messages."): n for name, n in sorted(counts.items())
            },
        )


class MessageTest(Model):
    """Result of a test for each recipient."""

    told: list[Told]


def _push(push: contacts.Push, public_key: str | None, last: list[Told]) -> PushChannel:
    return PushChannel(
        on=push.on,
        contact=push.contact,
        public_key=public_key,
        devices=[
            PushDevice(
                device_id=one.device_id,
                who=one.who,
                language=one.language,
                since=format_stamp(one.since),
            )
            for one in push.devices
        ],
        last=last,
    )


def _email(email: contacts.Email, last: list[Told]) -> EmailChannel:
    return EmailChannel(
        on=email.on,
        server=email.server,
        port=email.port,
        security=email.security,
        user=email.user,
        has_password=bool(email.password),
        sender=email.sender,
        recipients=[
            Recipient(who=one.who, address=one.address) for one in email.recipients
        ],
        least=email.least,
        language=email.language,
        last=last,
    )


def _webhook(hook: contacts.Webhook, last: list[Told]) -> WebhookChannel:
    host = urlsplit(hook.url).hostname if hook.url else None
    return WebhookChannel(
        on=hook.on, who=hook.who, host=host, least=hook.least, last=last
    )
