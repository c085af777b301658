"""``iveg user``: who may sign in, from the machine itself."""

import argparse
import secrets
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from iveg.adapters import clock
from iveg.adapters.doctor import check_database
from iveg.adapters.history.accounts import AccountStore
from iveg.adapters.history.api_tokens import ApiTokenStore
from iveg.adapters.history.engine import history_url
from iveg.adapters.ids import new_id
from iveg.cli.running import page_address
from iveg.domain.accounts import (
    Account,
    ApiToken,
    PersonRole,
    TokenScope,
    is_name,
    name_key,
)
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import NotANameError, UnknownNameError
from iveg.domain.retention import DAY_S
from iveg.domain.stamps import format_stamp
from iveg.settings import Settings
from iveg.web.security.people import digest_of

INVITED_S, SET_UP_S = 3 * DAY_S, 1800.0
"""How long an invitation waits, and the first of a new server (s)."""
FIRST_ADMIN = "admin"


def run_user(options: argparse.Namespace, settings: Settings, data: Path) -> int:
    """One action on accounts; returns the exit code.

    Raises:
        IvegError: it cannot be done.
    """
    url = history_url(settings.database_url, data)
    check_database(url)
    store, tokens = AccountStore(url), ApiTokenStore(url)
    try:
        if options.action == "token":
            print(add_token(tokens, options.name, options.scope))
        elif options.action == "revoke":
            tokens.revoke(options.name, CONSOLE)
            print(f"{options.name} is out within a second.")
        else:
            _act(options, settings, store)
        if options.action == "list":
            print(*_programs(tokens.read().values()), sep="\n", end="")
    finally:
        store.close()
        tokens.close()
    return 0


def _act(options: argparse.Namespace, settings: Settings, store: AccountStore) -> None:
    if options.action == "list":
        print(*_told(store.read().values()), sep="\n")
    elif options.action == "add":
        ends_at = clock.wall() + options.days * DAY_S if options.days else None
        invitation = add(store, options.name, options.role, INVITED_S, ends_at)
        _print_invitation(settings, invitation)
    elif options.action == "reset":
        _print_invitation(settings, invite_again(store, options.name, INVITED_S))
    elif options.action == "role":
        changed = replace(
            _find(store, options.name), role=options.role, since=clock.wall()
        )
        store.change(changed, "account_role", CONSOLE)
        print(f"{changed.name} is {changed.role}, and signs in anew.")
    else:
        off = replace(_find(store, options.name), disabled=True, invitation="")
        store.change(off, "account_disabled", CONSOLE)
        print(f"{off.name} is out within a second.")


def add(
    store: AccountStore,
    name: str,
    role: PersonRole,
    waits_s: float,
    ends_at: float | None = None,
) -> str:
    """Add an account; returns its invitation, which is stored nowhere.

    Raises:
        NotANameError: nobody may be called so.
        NameTakenError: somebody is called so already.
    """
    if not is_name(name):
        raise NotANameError(name)
    account = Account(new_id(), name, role, ends_at=ends_at)
    invitation, invited = _invited(account, waits_s)
    store.add(invited, CONSOLE)
    return invitation


def add_token(store: ApiTokenStore, name: str, scope: TokenScope) -> str:
    """Add a program; returns its token, which is stored nowhere.

    Raises:
        NotANameError: no program may be called so.
        NameTakenError: one is called so already.
    """
    if not is_name(name):
        raise NotANameError(name)
    token = secrets.token_urlsafe(32)
    made = ApiToken(new_id(), name, scope, digest_of(token), clock.wall())
    store.add(made, CONSOLE)
    return token


def invite_again(store: AccountStore, name: str, waits_s: float) -> str:
    """Take a password away, and return a new invitation; sessions end.

    Raises:
        UnknownNameError: nobody is called so.
    """
    account = replace(_find(store, name), password="", disabled=False)
    invitation, invited = _invited(account, waits_s)
    store.change(replace(invited, since=clock.wall()), "account_reset", CONSOLE)
    return invitation


def set_up(store: AccountStore, now: float) -> str | None:
    """An invitation for the first admin; None where somebody is admin already."""
    known = store.read().values()
    admins = [one for one in known if one.role == "admin" and one.is_open(now)]
    if any(one.password for one in admins):
        return None
    waiting = [one for one in known if name_key(one.name) == FIRST_ADMIN]
    if waiting:
        return invite_again(store, waiting[0].name, SET_UP_S)
    return add(store, FIRST_ADMIN, "admin", SET_UP_S)


def invitation_link(settings: Settings, invitation: str) -> str:
    """Address of the page that asks for a password."""
    return f"{page_address(settings)}/signin#invitation={invitation}"


def _invited(account: Account, waits_s: float) -> tuple[str, Account]:
    invitation = secrets.token_urlsafe(32)
    until = clock.wall() + waits_s
    return invitation, replace(
        account, invitation=digest_of(invitation), invited_until=until
    )


def _find(store: AccountStore, name: str) -> Account:
    key = name_key(name)
    for one in store.read().values():
        if name_key(one.name) == key:
            return one
    raise UnknownNameError("account", name)


def _print_invitation(settings: Settings, invitation: str) -> None:
    print("Their link, which works once and for 3 days:")
    print(invitation_link(settings, invitation))


def _told(accounts: Iterable[Account]) -> Iterable[str]:
    now = clock.wall()
    for one in sorted(accounts, key=lambda account: name_key(account.name)):
        yield f"{one.name}  {one.role}  {_state(one, now)}"


def _programs(tokens: Iterable[ApiToken]) -> Iterable[str]:
    for one in sorted(tokens, key=lambda token: name_key(token.name)):
        used = "never used" if one.used_at is None else format_stamp(one.used_at)
        yield f"{one.name}  program  {one.scope}  {used}\n"


def _state(account: Account, now: float) -> str:
    if account.disabled:
        return "disabled"
    if account.ends_at is not None:
        word = "until" if now < account.ends_at else "over since"
        return f"{word} {format_stamp(account.ends_at)}"
    return "active" if account.password else "invited"
