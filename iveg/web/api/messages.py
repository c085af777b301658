"""Contacts for messages outside iVeg, over HTTP: an operator reads and tests them.

What goes in as a secret never comes out: a password, the address of a webhook and the
keys of browsers are written and replaced, and never shown.
"""

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, HTTPException, Response
from pydantic import AfterValidator, Field

from iveg.adapters import push_encryption
from iveg.adapters.public_addresses import is_public_target
from iveg.domain import messages
from iveg.domain.messages import (
    Channel,
    Contacts,
    Language,
    Level,
    MessageText,
    OutboundMessage,
)
from iveg.models.alert import Told
from iveg.models.base import Body
from iveg.models.messages import Messages, MessageTest
from iveg.ngsi.texts import clean_text
from iveg.pipeline.messenger import Messenger
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.pages.sentences import Sentences
from iveg.web.pages.translations import LANGUAGES, read_translations
from iveg.web.refusals import refusals
from iveg.web.security.authentication import Principal, require

TEST_REST_S = 5.0
"""Between two tests: nobody sends mail or looks for servers with them."""


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

    def applied_to(self, before: messages.Email) -> messages.Email | None:
        """The settings with these changes; None where a password is missing."""
        password = before.password if self.password is None else self.password
        if self.password is None and password and self._goes_elsewhere(before):
            return None
        return messages.Email(
            on=self.on,
            server=self.server.lower(),
            port=self.port,
            security=self.security,
            user=self.user,
            password=password,
            sender=self.sender,
            recipients=tuple(
                messages.MailRecipient(one.who, one.address) for one in self.recipients
            ),
            least=self.least,
            language=self.language,
        )

    def _goes_elsewhere(self, before: messages.Email) -> bool:
        now = self.server.lower(), self.port, self.security, self.user
        return now != (before.server, before.port, before.security, before.user)


class WebhookBody(Body):
    """The whole of it; `url` null keeps the one that is there."""

    on: bool
    who: _Who
    url: _URL | None = None
    least: Level = "P1"

    def applied_to(self, before: messages.Webhook) -> messages.Webhook:
        """The settings with these changes."""
        url = before.url if self.url is None else self.url
        return messages.Webhook(self.on, self.who, url, self.least)


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

    def device(self, device_id: str, since: float) -> messages.SubscribedBrowser:
        """The browser under a name of its own."""
        return messages.SubscribedBrowser(
            device_id,
            self.who,
            self.endpoint,
            self.keys.p256dh,
            self.keys.auth,
            self.language,
            since,
        )


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
        if len(_others(push, body.endpoint)) >= messages.MOST_DEVICES:
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


_Operator = Annotated[Principal, Depends(require("release"))]


def router(desk: Desk) -> APIRouter:
    """Operators alone: here are people's addresses."""
    routes = APIRouter(
        prefix="/api/v1/messages", tags=["messages"], responses=refusals(503)
    )
    _add_channels(routes, desk)
    _add_devices(routes, desk)

    @routes.get("", response_model=Messages)
    async def read(_: _Operator) -> Response:
        """Recipients by channel, and the result of the newest message."""
        return desk.answer()

    @routes.post(
        "/{channel}/test", response_model=MessageTest, responses=refusals(409, 429)
    )
    async def test(channel: Channel, _: _Operator) -> Response:
        """Send a test now, whether or not the channel is on."""
        return await desk.test(channel)

    return routes


def _add_channels(routes: APIRouter, desk: Desk) -> None:
    @routes.put("/email", response_model=Messages)
    async def put_email(body: EmailBody, who: _Operator) -> Response:
        """Change the mail."""
        email = body.applied_to(desk.contacts.email)
        if email is None:
            raise HTTPException(
                422, "Type the password again: server or user are others."
            )
        return await desk.change("email", who, lambda all_: replace(all_, email=email))

    @routes.put("/webhook", response_model=Messages)
    async def put_webhook(body: WebhookBody, who: _Operator) -> Response:
        """Change the webhook."""
        hook = body.applied_to(desk.contacts.webhook)
        if not is_public_target(hook.url):
            raise HTTPException(422, "The address must be a public https one.")
        return await desk.change(
            "webhook", who, lambda all_: replace(all_, webhook=hook)
        )

    @routes.put("/push", response_model=Messages)
    async def put_push(body: PushBody, who: _Operator) -> Response:
        """Change web push; the first time makes this server's key."""
        return await desk.change("push", who, lambda all_: _switched(all_, body))


def _add_devices(routes: APIRouter, desk: Desk) -> None:
    @routes.post("/devices", response_model=Messages)
    async def add_device(body: DeviceBody, who: _Operator) -> Response:
        """Subscribe this browser; the same browser again replaces itself."""
        desk.check(body)
        device = body.device(desk.new_id(), desk.clock().wall)
        return await desk.change("push", who, lambda all_: _joined(all_, device))

    @routes.delete("/devices/{device_id}", response_model=Messages)
    async def remove_device(device_id: str, who: _Operator) -> Response:
        """Unsubscribe a browser."""
        known = {one.device_id for one in desk.contacts.push.devices}
        if device_id not in known:
            raise HTTPException(404, "There is no such device.")
        return await desk.change("push", who, lambda all_: all_.without({device_id}))


def _switched(all_: Contacts, body: PushBody) -> Contacts:
    key = all_.push.key or push_encryption.new_key()
    push = replace(all_.push, on=body.on, contact=body.contact, key=key)
    return replace(all_, push=push)


def _joined(all_: Contacts, device: messages.SubscribedBrowser) -> Contacts:
    devices = (*_others(all_.push, device.endpoint), device)
    return replace(all_, push=replace(all_.push, devices=devices))


def _others(push: messages.Push, endpoint: str) -> list[messages.SubscribedBrowser]:
    return [one for one in push.devices if one.endpoint != endpoint]


def writer() -> Callable[[OutboundMessage, Language], MessageText]:
    """Writes messages in words: priority and time, but no place and no person."""
    sentences = {one: Sentences(read_translations(one)) for one in LANGUAGES}

    def write(message: OutboundMessage, language: Language) -> MessageText:
        said = sentences[language]
        if message.is_test:
            return MessageText(
                said.say("messages.test_title", {}), said.say("messages.test_body", {})
            )
        slots = {
            "priority": message.priority,
            "count": len(message.items),
            "at": min(one.raised.wall for one in message.items),
        }
        key = "one" if len(message.items) == 1 else "more"
        return MessageText(
            said.say("messages.title", slots), said.say(f"messages.body_{key}", slots)
        )

    return write
