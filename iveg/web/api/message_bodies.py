"""Bodies with which an operator changes how people are told."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from iveg.domain import contacts, messages
from iveg.domain.messages import Language, Level
from iveg.models.base import Body
from iveg.ngsi.texts import clean_text


def _clean(who: str) -> str:
    cleaned = clean_text(who).strip()
    if not cleaned:
        raise ValueError("who must not be empty")
    return cleaned


_ADDRESS = r"^[^\s@<>\"',;:()\\]{1,64}@[A-Za-z0-9.-]{1,190}$"
_HOST = r"^[A-Za-z0-9.-]{1,253}$"
_PORTS = Literal[25, 465, 587, 2525]
_URL = Annotated[str, Field(max_length=1024, pattern=r"^https://[!-~]+$")]
_Who = Annotated[str, Field(min_length=1, max_length=40), AfterValidator(_clean)]
_Address = Annotated[str, Field(pattern=_ADDRESS)]
_Secret = Annotated[str, Field(max_length=256)]


class RecipientBody(Body):
    """Somebody with an address."""

    who: _Who
    address: _Address


class EmailBody(Body):
    """The whole of it; `password` null keeps the one that is there.

    It has to be typed anew where server, port or user are others: nobody reads it by
    having it sent to a server of their own.
    """

    on: bool
    server: Annotated[str, Field(pattern=_HOST)]
    port: _PORTS
    security: Literal["tls", "starttls"]
    user: Annotated[str, Field(max_length=128)] = ""
    password: _Secret | None = None
    sender: _Address
    recipients: Annotated[
        list[RecipientBody],
        Field(min_length=1, max_length=messages.MOST_RECIPIENTS),
    ]
    least: Level = "P1"
    language: Language = "es"

    def applied_to(self, before: contacts.Email) -> contacts.Email | None:
        """The settings with these changes; None where a password is missing."""
        password = before.password if self.password is None else self.password
        if self.password is None and password and self._goes_elsewhere(before):
            return None
        return contacts.Email(
            on=self.on,
            server=self.server.lower(),
            port=self.port,
            security=self.security,
            user=self.user,
            password=password,
            sender=self.sender,
            recipients=tuple(
                contacts.MailRecipient(one.who, one.address) for one in self.recipients
            ),
            least=self.least,
            language=self.language,
        )

    def _goes_elsewhere(self, before: contacts.Email) -> bool:
        now = self.server.lower(), self.port, self.security, self.user
        return now != (before.server, before.port, before.security, before.user)


class WebhookBody(Body):
    """The whole of it; `url` null keeps the one that is there."""

    on: bool
    who: _Who
    url: _URL | None = None
    least: Level = "P1"

    def applied_to(self, before: contacts.Webhook) -> contacts.Webhook:
        """The settings with these changes."""
        url = before.url if self.url is None else self.url
        return contacts.Webhook(self.on, self.who, url, self.least)


class PushBody(Body):
    """`contact`: where push services find whoever runs this server; empty: nowhere."""

    on: bool
    contact: _Address | Literal[""] = ""


class KeysBody(Body):
    """As `PushSubscription.toJSON` writes them."""

    p256dh: Annotated[str, Field(max_length=128)]
    auth: Annotated[str, Field(min_length=20, max_length=32)]


class DeviceBody(Body):
    """A browser that asks to be told."""

    who: _Who
    endpoint: _URL
    keys: KeysBody
    language: Language

    def device(self, device_id: str, since: float) -> contacts.SubscribedBrowser:
        """The browser under a name of its own."""
        return contacts.SubscribedBrowser(
            device_id,
            self.who,
            self.endpoint,
            self.keys.p256dh,
            self.keys.auth,
            self.language,
            since,
        )
