"""``iveg user``: who may sign in, from the machine itself."""

import argparse
from collections.abc import Iterable
from contextlib import suppress
from typing import TypeVar

from iveg.adapters import clock
from iveg.adapters.access_file import AccessFile
from iveg.adapters.admission import Admission
from iveg.adapters.database_check import check_database
from iveg.adapters.history.engine import history_url
from iveg.adapters.history.queries import earlier_access
from iveg.app.outside import ACCOUNTS, files_of
from iveg.cli.arguments import CommandCall
from iveg.cli.running import page_address
from iveg.domain.accounts import AccessBook, Account, ApiToken, find_named, name_key
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import NameTakenError, UnknownNameError
from iveg.domain.retention import DAY_S
from iveg.domain.stamps import format_stamp
from iveg.settings import Settings

_Row = TypeVar("_Row", Account, ApiToken)


def run(call: CommandCall) -> int:
    """One action on accounts; returns the exit code.

    Raises:
        IvegError: it cannot be done.
    """
    options, settings = call.options, call.settings
    url = history_url(settings.database_url, call.data)
    file = AccessFile(files_of(url, call.data) / ACCOUNTS)
    book = _known(file, url)
    book.on_change.append(file.leave)
    try:
        print(_act(options, settings, book))
    finally:
        file.close()
    return 0


def _known(file: AccessFile, url: str) -> AccessBook:
    """All who are known, with the changes that no server has taken up yet."""
    rows, _ = file.read()
    if not file.exists:
        check_database(url)
        rows = earlier_access(url) or rows
    book = AccessBook(rows)
    for _, change in file.left():
        with suppress(NameTakenError):
            book.apply(change)
    return book


def _act(options: argparse.Namespace, settings: Settings, book: AccessBook) -> str:
    """One action on accounts; returns what is to be printed."""
    now = clock.wall()
    admission = Admission(book, CONSOLE, now)
    match options.action:
        case "token":
            made = (options.name, options.scope, _end(options, now))
            return admission.give_token(*made)[0]
        case "revoke":
            admission.revoke(_find(book.tokens.values(), "token", options.name))
            return f"{options.name} is out within a second."
        case "list":
            people, programs = book.accounts.values(), book.tokens.values()
            return "\n".join((*_lines(people), *_programs(programs)))
        case "add":
            invited = (options.name, options.role, _end(options, now))
            return _invited(settings, admission.add(*invited)[0])
    found = _find(book.accounts.values(), "account", options.name)
    match options.action:
        case "reset":
            return _invited(settings, admission.reset(found)[0])
        case "role":
            changed = admission.give_role(found, options.role)
            return f"{changed.name} is {changed.role}, and signs in anew."
    return f"{admission.disable(found).name} is out within a second."


def _end(options: argparse.Namespace, now: float) -> float | None:
    """When what is made ends by itself (Unix s); None: never."""
    return now + options.days * DAY_S if options.days else None


def invitation_link(settings: Settings, invitation: str) -> str:
    """Address of the page that asks for a password."""
    return f"{page_address(settings)}/signin#invitation={invitation}"


def _find(known: Iterable[_Row], kind: str, name: str) -> _Row:
    found = find_named(known, name)
    if found is None:
        raise UnknownNameError(kind, name)
    return found


def _invited(settings: Settings, invitation: str) -> str:
    if not invitation:
        return "They may sign in at the identity provider again."
    link = invitation_link(settings, invitation)
    return f"Their link, which works once and for 3 days:\n{link}"


def _lines(accounts: Iterable[Account]) -> Iterable[str]:
    now = clock.wall()
    for account in sorted(accounts, key=lambda account: name_key(account.name)):
        yield f"{account.name}  {account.role}  {_state(account, now)}"


def _programs(tokens: Iterable[ApiToken]) -> Iterable[str]:
    for token in sorted(tokens, key=lambda token: name_key(token.name)):
        used = "never used" if token.used_at is None else format_stamp(token.used_at)
        ends = "" if token.ends_at is None else f", ends {format_stamp(token.ends_at)}"
        yield f"{token.name}  program  {token.scope}  {used}{ends}"


def _state(account: Account, now: float) -> str:
    state = account.state(now)
    if account.ends_at is None or state == "disabled":
        return state
    return f"{state}, ends {format_stamp(account.ends_at)}"
