"""Accounts of people over HTTP, for admins: invite, change a role, reset, shut out.

An invitation is a password until it is taken: it leaves by the one answer that made it.
"""

from collections.abc import Callable, Mapping
from typing import Annotated, TypeVar

from fastapi import APIRouter, Depends, HTTPException, Request, Response
from pydantic import AfterValidator, Field

from iveg.adapters.admission import MOST_ACCOUNTS, Admission
from iveg.domain.accounts import MOST_NAME, Account, PersonRole, is_name, name_key
from iveg.domain.errors import NotAllowedError, UnknownNameError
from iveg.domain.retention import DAY_S
from iveg.models.base import Body, Listing
from iveg.models.signing_in import Invitation, UserAccount
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.sign_in_code import code_of
from iveg.web.refusals import refusals
from iveg.web.security.people import People
from iveg.web.security.requirements import Admin, require
from iveg.web.security.roles import Principal

_Known = Mapping[str, Account]
_T = TypeVar("_T")
_Work = Callable[[Admission, _Known], _T]


def named(text: str) -> str:
    """A name that somebody may have. Raises ValueError."""
    if not is_name(text):
        raise ValueError("not a name")
    return text


def end_of(days: int | None, now: float) -> float | None:
    """When something ends by itself (Unix s), after so many days; None: never."""
    return None if days is None else now + days * DAY_S


Days = Annotated[int, Field(ge=1, le=3650)]
Name = Annotated[str, Field(max_length=MOST_NAME), AfterValidator(named)]


class UserBody(Body):
    """Somebody new; `days` until the account ends by itself."""

    name: Name
    role: PersonRole
    days: Days | None = None


class RoleBody(Body):
    """The role that is to be."""

    role: PersonRole


def router(people: People, clock: Clock) -> APIRouter:
    """The routes of accounts; all for admins."""
    routes = APIRouter(
        prefix="/api/v1/users",
        tags=["users"],
        dependencies=[Depends(require("admin"))],
        responses=refusals(409, 503),
    )

    @routes.get("", response_model=Listing[UserAccount])
    async def users(who: Admin) -> Response:
        """Every account, by name."""
        known, now = await people.known(), clock().wall
        items = [
            UserAccount.of(one, now, own=user_id == who.person)
            for user_id, one in known.items()
        ]
        items.sort(key=lambda one: name_key(one.name))
        return Json(Listing(items=items))

    @routes.post("", response_model=Invitation, status_code=201)
    async def invite(request: Request, body: UserBody, who: Admin) -> Response:
        """Add an account, and show its invitation this once."""
        now = clock().wall
        ends_at = end_of(body.days, now)

        def work(admission: Admission, known: _Known) -> tuple[str, Account]:
            if len(known) >= MOST_ACCOUNTS:
                raise HTTPException(409, f"There are {MOST_ACCOUNTS} accounts already.")
            return admission.add(body.name, body.role, ends_at)

        return _invitation(request, await _change(people, clock, who, work), now, 201)

    _add_changes(routes, people, clock)
    return routes


def _add_changes(routes: APIRouter, people: People, clock: Clock) -> None:
    @routes.put("/{user_id}/role", response_model=UserAccount)
    async def give_role(user_id: str, body: RoleBody, who: Admin) -> Response:
        """Change a role; the person signs in anew."""
        changed = await _change(
            people,
            clock,
            who,
            lambda admission, known: admission.give_role(
                _other(known, user_id, who), body.role
            ),
        )
        return Json(UserAccount.of(changed, clock().wall))

    @routes.post("/{user_id}/reset", response_model=Invitation)
    async def reset(request: Request, user_id: str, who: Admin) -> Response:
        """Take a password away, let in who was shut out, and invite again."""
        made = await _change(
            people,
            clock,
            who,
            lambda admission, known: admission.reset(_other(known, user_id, who)),
        )
        return _invitation(request, made, clock().wall)

    @routes.post("/{user_id}/disable", response_model=UserAccount)
    async def disable(user_id: str, who: Admin) -> Response:
        """Shut somebody out at once, STOP included."""
        off = await _change(
            people,
            clock,
            who,
            lambda admission, known: admission.disable(_other(known, user_id, who)),
        )
        return Json(UserAccount.of(off, clock().wall))


async def _change(people: People, clock: Clock, who: Principal, work: _Work[_T]) -> _T:
    """Change accounts as somebody who is admin still, when their turn comes.

    Two who shut each other out at the same moment come one after the other, and the
    second is admin no longer.  So is whoever is left: nobody changes their own.

    Raises:
        NotAllowedError: they are not.
        HopError: the database is away.
    """

    def checked(admission: Admission, known: _Known) -> _T:
        account, began = known.get(who.person), who.signed_in_at
        if (
            account is None
            or account.role != "admin"
            or not account.is_open(clock().wall)
            or began is None
            or began < account.since
        ):
            raise NotAllowedError("admin", "former admin")
        return work(admission, known)

    return await people.change(who, checked)


def _other(known: _Known, user_id: str, who: Principal) -> Account:
    """The account of somebody else: whoever changes accounts stays admin."""
    if user_id == who.person:
        raise HTTPException(409, "Another admin changes your own account.")
    found = known.get(user_id)
    if found is None:
        raise UnknownNameError("account", user_id)
    return found


def _invitation(
    request: Request, made: tuple[str, Account], now: float, status: int = 200
) -> Response:
    invitation, account = made
    code = code_of(request, f"invitation={invitation}") if invitation else None
    return Json(Invitation(user=UserAccount.of(account, now), code=code), status)
