"""Contacts for messages outside iVeg, over HTTP: an operator reads and tests them.

What goes in as a secret never comes out: a password, the address of a webhook and the
keys of browsers are written and replaced, and never shown.
"""

from dataclasses import replace

from fastapi import APIRouter, HTTPException, Response

from iveg.adapters import push_encryption
from iveg.adapters.public_addresses import is_public_target
from iveg.domain import contacts
from iveg.domain.contacts import Contacts
from iveg.domain.messages import Channel
from iveg.models.messages import Messages, MessageTest
from iveg.web.api.message_bodies import DeviceBody, EmailBody, PushBody, WebhookBody
from iveg.web.api.message_desk import Desk, others
from iveg.web.refusals import refusals
from iveg.web.security.requirements import Operator


def router(desk: Desk) -> APIRouter:
    """Operators alone: here are people's addresses."""
    routes = APIRouter(
        prefix="/api/v1/messages", tags=["messages"], responses=refusals(503)
    )
    _add_channels(routes, desk)
    _add_devices(routes, desk)

    @routes.get("", response_model=Messages)
    async def read(_: Operator) -> Response:
        """Recipients by channel, and the result of the newest message."""
        return desk.answer()

    @routes.post(
        "/{channel}/test", response_model=MessageTest, responses=refusals(409, 429)
    )
    async def test(channel: Channel, _: Operator) -> Response:
        """Send a test now, whether or not the channel is on."""
        return await desk.test(channel)

    return routes


def _add_channels(routes: APIRouter, desk: Desk) -> None:
    @routes.put("/email", response_model=Messages)
    async def put_email(body: EmailBody, who: Operator) -> Response:
        """Change the mail."""
        email = body.applied_to(desk.contacts.email)
        if email is None:
            raise HTTPException(
                422, "Type the password again: server or user are others."
            )
        return await desk.change("email", who, lambda all_: replace(all_, email=email))

    @routes.put("/webhook", response_model=Messages)
    async def put_webhook(body: WebhookBody, who: Operator) -> Response:
        """Change the webhook."""
        hook = body.applied_to(desk.contacts.webhook)
        if not is_public_target(hook.url):
            raise HTTPException(422, "The address must be a public https one.")
        return await desk.change(
            "webhook", who, lambda all_: replace(all_, webhook=hook)
        )

    @routes.put("/push", response_model=Messages)
    async def put_push(body: PushBody, who: Operator) -> Response:
        """Change web push; the first time makes this server's key."""
        return await desk.change("push", who, lambda all_: _switched(all_, body))


def _add_devices(routes: APIRouter, desk: Desk) -> None:
    @routes.post("/devices", response_model=Messages)
    async def add_device(body: DeviceBody, who: Operator) -> Response:
        """Subscribe this browser; the same browser again replaces itself."""
        desk.check(body)
        device = body.device(desk.new_id(), desk.clock().wall)
        return await desk.change("push", who, lambda all_: _joined(all_, device))

    @routes.delete("/devices/{device_id}", response_model=Messages)
    async def remove_device(device_id: str, who: Operator) -> Response:
        """Unsubscribe a browser."""
        known = {one.device_id for one in desk.contacts.push.devices}
        if device_id not in known:
            raise HTTPException(404, "There is no such device.")
        return await desk.change("push", who, lambda all_: all_.without({device_id}))


def _switched(all_: Contacts, body: PushBody) -> Contacts:
    key = all_.push.key or push_encryption.new_key()
    push = replace(all_.push, on=body.on, contact=body.contact, key=key)
    return replace(all_, push=push)


def _joined(all_: Contacts, device: contacts.SubscribedBrowser) -> Contacts:
    devices = (*others(all_.push, device.endpoint), device)
    return replace(all_, push=replace(all_.push, devices=devices))
