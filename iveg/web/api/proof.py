"""Proving anew who one is, while signed in: what a release may ask for."""

from collections.abc import Awaitable, Callable
from typing import Annotated, Any, Final

from fastapi import APIRouter, Request, Response
from pydantic import Field

from iveg.adapters.passwords import MOST
from iveg.domain.accounts import Account
from iveg.domain.errors import UnknownNameError
from iveg.domain.pins import MOST_DIGITS
from iveg.models.base import Body
from iveg.models.passkeys import Proof
from iveg.web.api.answers import Json
from iveg.web.api.passkeys import account_of
from iveg.web.problem import Problem
from iveg.web.refusals import refusals
from iveg.web.security.answer import AnswerOfDevice
from iveg.web.security.passkeys import Passkeys, site_of
from iveg.web.security.people import People
from iveg.web.security.requirements import Reader, authenticator_of
from iveg.web.security.roles import Principal
from iveg.web.security.tablets import Pins

_WRONG: Final = Problem(403, "This does not prove who you are.", "proof-wrong")
_PURPOSE: Final = "prove "


class ByPassword(Body):
    """The password of the account."""

    password: Annotated[str, Field(max_length=MOST)]


class ByPasskey(Body):
    """What a device answered to the challenge of `GET /account/proof/options`."""

    passkey: AnswerOfDevice


class ByPin(Body):
    """What unlocks a shared tablet as this person."""

    pin: Annotated[str, Field(max_length=MOST_DIGITS)]


ProofBody = ByPassword | ByPasskey | ByPin


def router(people: People, passkeys: Passkeys, pins: Pins) -> APIRouter:
    """The routes of a proof; `people` says whose account somebody's is."""
    routes = APIRouter(
        prefix="/api/v1/account/proof",
        tags=["account"],
        responses=refusals(404, 409, 429, 501),
    )

    @routes.get("", response_model=Proof)
    async def state(request: Request, who: Reader) -> Response:
        """Whether a release would ask for one, and by what it may be given."""
        account = people.account(who.person)
        ways = [] if account is None else _ways(who, account, passkeys)
        if who.is_tablet:
            # Nobody types a password on a screen that is everybody's.
            ways = [way for way in ways if way == "pin"]
        freshness = authenticator_of(request).freshness
        until, needed = freshness.until(who), freshness.is_stale(who)
        return Json(Proof.of(until, ways, needed=needed))

    @routes.get("/options", response_model=dict[str, Any])
    async def begin(request: Request, who: Reader) -> Response:
        """Options of a proof by one of one's own passkeys."""
        own = account_of(people, who).account_id
        known = passkeys.of(own)
        asked = await passkeys.ask_to_prove(
            site_of(request), own, _PURPOSE + own, known
        )
        return Json(asked)

    @routes.post("", status_code=204)
    async def give(request: Request, body: ProofBody, who: Reader) -> Response:
        """Prove who is there; counts as a sign-in does."""
        account = people.account(who.person)
        if account is None:
            raise UnknownNameError("account", who.name)
        authenticator = authenticator_of(request)
        if isinstance(body, ByPin):
            # It is waited for by person, not by address.
            await pins.look(account.account_id, body.pin)
            authenticator.sessions.proven(who)
            return Response(status_code=204)
        proof = _looking(request, body, account, people, passkeys)
        found = await authenticator.attempts.weigh(request, "wrong proof", proof)
        if isinstance(found, Problem):
            return (_WRONG if found.status == 401 else found).response()
        authenticator.sessions.proven(who)
        return Response(status_code=204)

    return routes


def _ways(who: Principal, account: Account, passkeys: Passkeys) -> list[str]:
    ways = {
        "password": bool(account.password),
        "passkey": bool(passkeys.of(account.account_id)),
        "pin": bool(account.pin),
        # The browser goes to the provider and comes back (web/pages/sign_on.py).
        "sso": who.method == "sso",
    }
    return [way for way, there in ways.items() if there]


def _looking(
    request: Request,
    body: ByPassword | ByPasskey,
    account: Account,
    people: People,
    passkeys: Passkeys,
) -> Callable[[], Awaitable[object]]:
    match body:
        case ByPassword(password=password):
            return lambda: people.proven(account, password)
        case ByPasskey(passkey=answer):
            site, purpose = site_of(request), _PURPOSE + account.account_id
            return lambda: passkeys.prove(site, answer, purpose)
