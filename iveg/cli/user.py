"""``iveg user``: manages accounts on the server's own machine."""

import argparse
from collections.abc import Iterable
from contextlib import suppress

from iveg.adapters import clock
from iveg.adapters.access_file import AccessFile
from iveg.adapters.admission import Admission
from iveg.adapters.database_check import check_database
from iveg.adapters.history.engine import history_url
from iveg.adapters.history.queries import earlier_access
from iveg.app import ACCOUNTS_FILE, files_of
from iveg.cli.arguments import CommandCall
from iveg.cli.running import page_address
from iveg.domain.accounts import AccessBook, Account, find_named, name_key
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import NameTakenError, UnknownNameError
from iveg.domain.retention import DAY_S
from iveg.domain.stamps import format_stamp
from iveg.settings import Settings


def run(call: CommandCall) -> int:
    """Run an action on accounts; returns the exit code.

    Raises:
        IvegError: it cannot be done.
    """
    options, settings = call.options, call.settings
    url = history_url(settings.database_url, call.data)
    file = AccessFile(files_of(url, call.data) / ACCOUNTS_FILE)
    book = _known(file, url)
    # In a second file, since a running server would overwrite the first.
    book.on_change.append(file.leave)
    try:
        print(_act(options, settings, book))
    finally:
        file.close()
    return 0


def _known(file: AccessFile, url: str) -> AccessBook:
    """All accounts, with changes that no server has taken up yet."""
    rows, _ = file.read()
    if not file.exists:
        # No server has started yet, to copy accounts of an earlier version.
        check_database(url)
        rows = earlier_access(url) or rows
    book = AccessBook(rows)
    for _, change in file.left():
        with suppress(NameTakenError):
            book.apply(change)
    return book


def _act(options: argparse.Namespace, settings: Settings, book: AccessBook) -> str:
    """Run an action on accounts; returns the text to print."""
    now = clock.wall()
    admission = Admission(book, CONSOLE, now)
    if options.action == "list":
        return "\n".join(_lines(book.accounts.values(), now))
    if options.action == "add":
        ends_at = now + options.days * DAY_S if options.days else None
        invitation, _ = admission.add(options.name, options.role, ends_at)
        return _invited(settings, invitation)
    account = find_named(book.accounts.values(), options.name)
    if account is None:
        raise UnknownNameError("account", options.name)
    if options.action == "reset":
        return _invited(settings, admission.reset(account)[0])
    return f"{admission.disable(account).name} is out within a second."


def invitation_link(settings: Settings, invitation: str) -> str:
    """Address of the page at which an invited person sets a password."""
    return f"{page_address(settings)}/signin#invitation={invitation}"


def _invited(settings: Settings, invitation: str) -> str:
    if not invitation:
        return "They may sign in at the identity provider again."
    link = invitation_link(settings, invitation)
    return f"Their link, which works once and for 3 days:\n{link}"


def _lines(accounts: Iterable[Account], now: float) -> Iterable[str]:
    for account in sorted(accounts, key=lambda account: name_key(account.name)):
        state, ends = account.state(now), ""
        if account.ends_at is not None and state != "disabled":
            ends = f", ends {format_stamp(account.ends_at)}"
        yield f"{account.name}  {account.role}  {state}{ends}"
