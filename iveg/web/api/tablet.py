"""A shared tablet over HTTP: make a browser one, unlock it by a PIN, lock it."""

from math import ceil
from typing import Annotated

from fastapi import APIRouter, HTTPException, Request, Response
from pydantic import AfterValidator, Field

from iveg.domain.pins import MOST_DIGITS, is_pin
from iveg.models.base import Body
from iveg.models.tablets import Tablet, TabletPerson
from iveg.web.api.answers import Json
from iveg.web.api.passkeys import account_of
from iveg.web.api.users import Name
from iveg.web.refusals import refusals
from iveg.web.security.authentication import Authenticator
from iveg.web.security.people import People
from iveg.web.security.requirements import ProvenOperator, Reader, authenticator_of
from iveg.web.security.roles import Principal
from iveg.web.security.tablets import Pins


def _chosen(text: str) -> str:
    if not is_pin(text):
        raise ValueError("not a PIN")
    return text


class TabletBody(Body):
    """What the tablet is called, in all that it does while it is locked."""

    name: Name


class UnlockBody(Body):
    """Whose PIN it is, and the PIN."""

    person_id: Annotated[str, Field(max_length=64)]
    pin: Annotated[str, Field(max_length=MOST_DIGITS)]


class PinBody(Body):
    """A PIN of 4 to 8 digits, neither one digit again and again nor a run."""

    pin: Annotated[str, Field(max_length=MOST_DIGITS), AfterValidator(_chosen)]


def router(people: People, pins: Pins) -> APIRouter:
    """The routes of tablets, and of the PIN of whoever asks."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["tablet"],
        responses=refusals(404, 409, 429, 503),
    )

    @routes.get("/tablet", response_model=Tablet)
    async def state(request: Request, who: Reader) -> Response:
        """Whether it is locked, and who may unlock it; 404 where it is no tablet."""
        return _tablet(authenticator_of(request), pins, who)

    @routes.post("/tablet", response_model=Tablet, status_code=201)
    async def make(request: Request, body: TabletBody, who: ProvenOperator) -> Response:
        """Make this browser a tablet; whoever did is signed out of it."""
        if who.session is None or who.is_tablet:
            raise HTTPException(409, "Only a browser of one person becomes a tablet.")
        authenticator = authenticator_of(request)
        authenticator.sessions.make_tablet(who, body.name)
        return _tablet(authenticator, pins, who, 201)

    @routes.post("/tablet/unlock", response_model=Tablet)
    async def unlock(request: Request, body: UnlockBody, who: Reader) -> Response:
        """Have the tablet act as somebody, until two minutes after their last act."""
        authenticator = authenticator_of(request)
        _require_tablet(who)
        account = await pins.look(body.person_id, body.pin)
        authenticator.sessions.unlock(who, account.account_id)
        return _tablet(authenticator, pins, who)

    @routes.post("/tablet/lock", response_model=Tablet)
    async def lock(request: Request, who: Reader) -> Response:
        """Have the tablet act as nobody at once."""
        authenticator = authenticator_of(request)
        _require_tablet(who)
        authenticator.sessions.lock(who)
        return _tablet(authenticator, pins, who)

    _add_pin(routes, people, pins)
    return routes


def _add_pin(routes: APIRouter, people: People, pins: Pins) -> None:
    @routes.put("/account/pin", status_code=204)
    async def choose(request: Request, body: PinBody, who: Reader) -> None:
        """Choose the PIN by which tablets are unlocked as oneself."""
        account = account_of(people, who)
        authenticator_of(request).freshness.refuse_stale(who)
        await people.give_pin(who, account, body.pin)
        pins.forget(account.account_id)

    @routes.delete("/account/pin", status_code=204)
    async def remove(who: Reader) -> None:
        """Have no PIN any more; tablets that it has unlocked lock at once."""
        await people.give_pin(who, account_of(people, who), "")


def _require_tablet(who: Principal) -> None:
    if not who.is_tablet:
        raise HTTPException(404, "This browser is no shared tablet.")


def _tablet(
    authenticator: Authenticator, pins: Pins, who: Principal, status: int = 200
) -> Response:
    now = authenticator.current(who)
    if now is None:
        raise HTTPException(404, "This browser is no shared tablet.")
    _require_tablet(now)
    is_open = now.method == "pin"
    sessions = authenticator.sessions
    return Json(
        Tablet(
            name=sessions.tablet_name(now),
            holder=now.name if is_open else None,
            role="operator" if now.may("release") else "viewer",
            left_s=round(sessions.unlocked_s(now), 1) if is_open else 0.0,
            people=[
                TabletPerson(
                    person_id=one.account_id, name=one.name, blocked_s=ceil(wait_s)
                )
                for one, wait_s in pins.holders()
            ],
        ),
        status,
    )
