"""Passkeys over HTTP: those of whoever asks, and the challenge of a sign-in."""

from typing import Any, Final

from fastapi import APIRouter, Depends, HTTPException, Request, Response

from iveg.domain.accounts import Account
from iveg.domain.errors import UnknownNameError
from iveg.domain.passkeys import MOST_PASSKEYS, Passkey
from iveg.models.base import Body, Listing
from iveg.models.passkeys import PasskeyOfPerson
from iveg.web.api.answers import Json
from iveg.web.api.users import Name
from iveg.web.problem import Problem
from iveg.web.refusals import refusals
from iveg.web.security.answer import AnswerOfDevice
from iveg.web.security.passkeys import SIGN_IN, Passkeys, site_of
from iveg.web.security.people import People
from iveg.web.security.requirements import Reader, authenticator_of, require
from iveg.web.security.roles import Principal

_REFUSED: Final = Problem(
    422, "This is no passkey that was asked for here.", "passkey-refused"
)


class PasskeyBody(Body):
    """What a device made, and what the person calls it."""

    name: Name
    passkey: AnswerOfDevice


def router(people: People, passkeys: Passkeys) -> APIRouter:
    """The routes of passkeys; `people` says whose account somebody's is."""
    routes = APIRouter(tags=["account"], responses=refusals(404, 409, 429, 501, 503))

    @routes.get(
        "/signin/passkey",
        dependencies=[Depends(require("open"))],
        include_in_schema=False,
    )
    async def ask(request: Request) -> Response:
        """Options by which a browser asks a device who is there."""
        address = "" if request.client is None else request.client.host
        site = site_of(request)
        return Json(await passkeys.ask_to_prove(site, address, SIGN_IN))

    _add_own(routes, people, passkeys)
    return routes


def _add_own(routes: APIRouter, people: People, passkeys: Passkeys) -> None:
    own = "/api/v1/account/passkeys"

    @routes.get(own, response_model=Listing[PasskeyOfPerson])
    async def listed(who: Reader) -> Response:
        """One's own passkeys, the oldest first."""
        known = passkeys.of(account_of(people, who).account_id)
        return Json(Listing(items=[PasskeyOfPerson.of(one) for one in known]))

    @routes.get(f"{own}/options", response_model=dict[str, Any])
    async def begin(request: Request, who: Reader) -> Response:
        """Options of a new passkey; its challenge waits for five minutes."""
        account = account_of(people, who)
        if len(passkeys.of(account.account_id)) >= MOST_PASSKEYS:
            raise HTTPException(409, f"You have {MOST_PASSKEYS} passkeys already.")
        # Whoever finds a screen unattended must not leave a key of their own behind.
        authenticator_of(request).freshness.refuse_stale(who)
        return Json(await passkeys.ask_to_register(site_of(request), account))

    @routes.post(own, response_model=PasskeyOfPerson, status_code=201)
    async def register(request: Request, body: PasskeyBody, who: Reader) -> Response:
        """Keep a passkey that answers the challenge."""
        account, site = account_of(people, who), site_of(request)
        made = await authenticator_of(request).attempts.weigh(
            request,
            "no passkey that was asked for",
            lambda: passkeys.register(site, account, body.name, body.passkey, who),
        )
        if isinstance(made, Passkey):
            return Json(PasskeyOfPerson.of(made), 201)
        return (_REFUSED if made.status == 401 else made).response()

    @routes.delete(f"{own}/{{passkey_id}}", status_code=204)
    async def remove(passkey_id: str, who: Reader) -> None:
        """Forget a passkey at once."""
        await passkeys.remove(account_of(people, who), passkey_id, who)


def account_of(people: People, who: Principal) -> Account:
    """The account of whoever asks. Raises UnknownNameError: they have none."""
    found = people.account(who.person) if who.has_account else None
    if found is None:
        raise UnknownNameError("account", who.name)
    return found
