"""Contacts: who is told outside iVeg, and by which channel."""

from collections.abc import Container
from dataclasses import dataclass, field, replace
from typing import Literal

from iveg.domain.messages import Channel, Language, Level, Priority


@dataclass(frozen=True, slots=True)
class MailRecipient:
    """Somebody with an address; ``who`` is what other people are shown."""

    who: str
    address: str


@dataclass(frozen=True, slots=True)
class Email:
    """Mail through somebody's server, always encrypted.

    Attributes:
        security: ``tls`` from the first byte, or ``starttls`` after a greeting.
        least: The least priority that is sent.
    """

    on: bool = False
    server: str = ""
    port: int = 465
    security: Literal["tls", "starttls"] = "tls"
    user: str = ""
    password: str = field(default="", repr=False)
    sender: str = ""
    recipients: tuple[MailRecipient, ...] = ()
    least: Level = "P1"
    language: Language = "es"


@dataclass(frozen=True, slots=True)
class Webhook:
    """An https address that takes JSON; the address itself is the secret."""

    on: bool = False
    who: str = ""
    url: str = field(default="", repr=False)
    least: Level = "P1"


@dataclass(frozen=True, slots=True)
class SubscribedBrowser:
    """One browser that asked for messages (Push API, ``PushSubscription``).

    Attributes:
        p256dh: Its public key, ``auth`` its secret, both base64url.
        since: When it asked (Unix s).
    """

    device_id: str
    who: str
    endpoint: str = field(repr=False)
    p256dh: str = field(repr=False)
    auth: str = field(repr=False)
    language: Language
    since: float


@dataclass(frozen=True, slots=True)
class Push:
    """Web push, for P1 alone.

    Attributes:
        contact: Address at which push services find whoever runs this server.
        key: iVeg's private key (P-256), base64url; empty before the first use.
    """

    on: bool = False
    contact: str = ""
    devices: tuple[SubscribedBrowser, ...] = ()
    key: str = field(default="", repr=False)


@dataclass(frozen=True, slots=True)
class Contacts:
    """All recipients outside the page; none at first."""

    push: Push = Push()
    email: Email = Email()
    webhook: Webhook = Webhook()

    def wants(self, channel: Channel, priority: Priority) -> bool:
        """Whether a channel is on and receives this priority."""
        if channel == "push":
            return self.push.on and priority == "P1"
        chosen = self.email if channel == "email" else self.webhook
        return chosen.on and priority <= chosen.least

    def without(self, device_ids: Container[str]) -> "Contacts":
        """The same, but for these devices."""
        devices = tuple(
            one for one in self.push.devices if one.device_id not in device_ids
        )
        return replace(self, push=replace(self.push, devices=devices))
