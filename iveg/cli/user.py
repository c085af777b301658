"""``iveg user``: who may sign in, from the machine itself."""

import argparse
from collections.abc import Iterable

from iveg.adapters import clock
from iveg.adapters.admission import Admission, has_admin
from iveg.adapters.database_check import check_database
from iveg.adapters.history.accounts import AccountRows, AccountStore
from iveg.adapters.history.api_tokens import ApiTokenStore
from iveg.adapters.history.engine import history_url
from iveg.adapters.program_admission import admit_program
from iveg.cli.arguments import CommandCall
from iveg.cli.running import page_address
from iveg.domain.accounts import (
    Account,
    ApiToken,
    name_key,
)
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import UnknownNameError
from iveg.domain.retention import DAY_S
from iveg.domain.stamps import format_stamp
from iveg.settings import Settings

SET_UP_S = 1800.0
"""How long the first invitation of a new server waits (s)."""
FIRST_ADMIN = "admin"


def run(call: CommandCall) -> int:
    """One action on accounts; returns the exit code.

    Raises:
        IvegError: it cannot be done.
    """
    options, settings = call.options, call.settings
    url = history_url(settings.database_url, call.data)
    check_database(url)
    store, tokens = AccountStore(url), ApiTokenStore(url)
    try:
        if options.action == "token":
            now = clock.wall()
            made = (options.name, options.scope, _end(options, now))
            print(admit_program(tokens, *made, by=CONSOLE, now=now)[0])
        elif options.action == "revoke":
            tokens.revoke(options.name, CONSOLE)
            print(f"{options.name} is out within a second.")
        else:
            print(store.together(lambda rows: _act(options, settings, rows)))
        if options.action == "list":
            print(*_programs(tokens.read().values()), sep="\n", end="")
    finally:
        store.close()
        tokens.close()
    return 0


def _act(options: argparse.Namespace, settings: Settings, rows: AccountRows) -> str:
    """One action on accounts; returns what is to be printed when it is kept."""
    now = clock.wall()
    admission = Admission(rows, CONSOLE, now)
    if options.action == "list":
        return "\n".join(_lines(rows.read().values()))
    if options.action == "add":
        made = (options.name, options.role, _end(options, now))
        return _invited(settings, admission.add(*made)[0])
    found = _find(rows, options.name)
    if options.action == "reset":
        return _invited(settings, admission.reset(found)[0])
    if options.action == "role":
        changed = admission.give_role(found, options.role)
        return f"{changed.name} is {changed.role}, and signs in anew."
    return f"{admission.disable(found).name} is out within a second."


def _end(options: argparse.Namespace, now: float) -> float | None:
    """When what is made ends by itself (Unix s); None: never."""
    return now + options.days * DAY_S if options.days else None


def set_up(store: AccountStore, now: float) -> str | None:
    """An invitation for the first admin; None where somebody is admin already."""
    return store.together(lambda rows: _set_up(rows, now))


def _set_up(rows: AccountRows, now: float) -> str | None:
    known = rows.read().values()
    if has_admin(known, now):
        return None
    admission = Admission(rows, CONSOLE, now)
    waiting = [one for one in known if name_key(one.name) == FIRST_ADMIN]
    if waiting:
        return admission.reset(waiting[0], SET_UP_S)[0]
    return admission.add(FIRST_ADMIN, "admin", waits_s=SET_UP_S)[0]


def invitation_link(settings: Settings, invitation: str) -> str:
    """Address of the page that asks for a password."""
    return f"{page_address(settings)}/signin#invitation={invitation}"


def _find(rows: AccountRows, name: str) -> Account:
    key = name_key(name)
    for one in rows.read().values():
        if name_key(one.name) == key:
            return one
    raise UnknownNameError("account", name)


def _invited(settings: Settings, invitation: str) -> str:
    if not invitation:
        return "They may sign in at the identity provider again."
    link = invitation_link(settings, invitation)
    return f"Their link, which works once and for 3 days:\n{link}"


def _lines(accounts: Iterable[Account]) -> Iterable[str]:
    now = clock.wall()
    for one in sorted(accounts, key=lambda account: name_key(account.name)):
        yield f"{one.name}  {one.role}  {_state(one, now)}"


def _programs(tokens: Iterable[ApiToken]) -> Iterable[str]:
    for one in sorted(tokens, key=lambda token: name_key(token.name)):
        used = "never used" if one.used_at is None else format_stamp(one.used_at)
        ends = "" if one.ends_at is None else f", ends {format_stamp(one.ends_at)}"
        yield f"{one.name}  program  {one.scope}  {used}{ends}\n"


def _state(account: Account, now: float) -> str:
    state = account.state(now)
    if account.ends_at is None or state == "disabled":
        return state
    return f"{state}, ends {format_stamp(account.ends_at)}"
