"""``iveg user``: accounts from the machine itself, each change in the audit."""

from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import Connection, text

from iveg.adapters import clock
from iveg.adapters.admission import Admission
from iveg.adapters.history.accounts import AccountRows, AccountStore
from iveg.adapters.history.api_tokens import ApiTokenStore
from iveg.adapters.history.asking import ask_once
from iveg.adapters.history.audit import faults
from iveg.cli import user
from iveg.cli.arguments import CommandCall
from iveg.cli.user import set_up
from iveg.domain.accounts import Account, PersonRole, digest_of
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import (
    NameTakenError,
    NotANameError,
    ProvidedAccountError,
    SignOnError,
    UnknownNameError,
)
from iveg.domain.stamps import format_stamp
from iveg.settings import Settings
from tests.databases import lay_history


class Console:
    """The command line on one machine."""

    def __init__(self, data: Path, database_url: str) -> None:
        self.settings = Settings(database_url=database_url)
        self._data = data
        lay_history(database_url)
        self.store = AccountStore(database_url)

    def call(self, action: str, name: str = "", **options: object) -> int:
        told = {"role": "operator", "days": None, **options}
        given = Namespace(action=action, name=name, **told)
        return user.run(CommandCall(given, self.settings, {}, self._data))

    def state(self, name: str) -> tuple[str, bool, bool]:
        one = next(one for one in self.store.read().values() if one.name == name)
        return one.role, one.disabled, bool(one.password)


@pytest.fixture
def console(tmp_path: Path) -> Iterator[Console]:
    console = Console(tmp_path, f"sqlite:///{tmp_path / 'history.db'}")
    yield console
    console.store.close()


def invitation_in(out: str) -> str:
    return out.strip().splitlines()[-1].rpartition("#invitation=")[2]


def test_a_person_is_added_by_a_link_of_which_only_a_digest_is_kept(
    console: Console, capsys: pytest.CaptureFixture[str]
) -> None:
    console.call("add", "Ana", role="admin")

    invitation = invitation_in(capsys.readouterr().out)
    (account,) = console.store.read().values()
    assert account.invitation == digest_of(invitation)
    now = clock.wall()
    assert console.store.accept(account.invitation, "#hash", now) is not None
    assert console.store.accept(account.invitation, "#other", now) is None
    assert console.state("Ana") == ("admin", False, True)


def test_a_password_is_changed_by_who_has_the_one_that_is_kept(
    console: Console, capsys: pytest.CaptureFixture[str]
) -> None:
    console.call("add", "Ana", role="admin")
    ana = replace(CONSOLE, person=next(iter(console.store.read())), name="Ana")
    invitation = digest_of(invitation_in(capsys.readouterr().out))
    nobody = console.store.change_password(ana, "", "#new", clock.wall())
    console.store.accept(invitation, "#old", clock.wall())

    late = console.store.change_password(ana, "#other", "#new", clock.wall())
    changed = console.store.change_password(ana, "#old", "#new", 9e9)
    console.store.choose_language(ana.person, "en")
    console.call("disable", "Ana")
    shut_out = console.store.change_password(ana, "#new", "#newer", clock.wall())

    assert (nobody, late, shut_out) == (None, None, None)
    assert changed is not None
    assert (changed.password, changed.since) == ("#new", 9e9)
    (kept,) = console.store.read().values()
    assert (kept.language, kept.disabled) == ("en", True)
    url = console.settings.database_url
    assert ask_once(url, lambda one: list(faults(one))) == []
    assert ask_once(url, _actions).count("password_changed") == 1


def test_whom_a_provider_vouches_for_is_kept_by_id_and_shut_out_from_here(
    console: Console, capsys: pytest.CaptureFixture[str]
) -> None:
    console.call("add", "Ana")
    told = Account("sso-1a2b3c4d", "Ana", "operator", provider="https://idm.test")

    def vouched(role: PersonRole) -> Account:
        def work(rows: AccountRows) -> Account:
            admission = Admission(rows, CONSOLE, clock.wall())
            return admission.vouched(rows.read(), replace(told, role=role))

        return console.store.together(work)

    vouched("operator")
    vouched("operator")
    name = vouched("viewer").name
    capsys.readouterr()
    console.call("list")
    listed = capsys.readouterr().out
    console.call("disable", name)
    with pytest.raises(SignOnError, match="disabled"):
        vouched("viewer")
    with pytest.raises(ProvidedAccountError):
        console.call("role", name, role="admin")
    console.call("reset", name)

    assert name == "Ana 1a2b3c"
    assert f"{name}  viewer  active" in listed
    assert "#invitation=" not in capsys.readouterr().out
    assert vouched("viewer").provider == "https://idm.test"


def test_what_raises_within_a_change_leaves_the_accounts_and_the_audit_as_they_were(
    console: Console,
) -> None:
    console.call("add", "Ana")
    (ana,) = console.store.read().values()

    def break_off(rows: AccountRows) -> None:
        rows.change(replace(ana, disabled=True), "account_disabled", CONSOLE)
        assert rows.read()[ana.account_id].disabled
        raise UnknownNameError("account", "Eva")

    with pytest.raises(UnknownNameError):
        console.store.together(break_off)

    assert console.store.read() == {ana.account_id: ana}
    assert ask_once(console.settings.database_url, _actions) == ["account_added"]


def test_reset_role_and_disable_end_sessions_and_are_in_the_audit(
    console: Console, capsys: pytest.CaptureFixture[str]
) -> None:
    console.call("add", "Ana")
    began = clock.wall()
    for action in ("reset", "role", "disable"):
        console.call(action, "ANA", role="viewer")

    (account,) = console.store.read().values()
    assert account.since >= began
    assert console.state("Ana") == ("viewer", True, False)
    url = console.settings.database_url
    assert ask_once(url, lambda one: list(faults(one))) == []
    assert ask_once(url, _actions) == [
        "account_added",
        "account_reset",
        "account_role",
        "account_disabled",
    ]


def test_the_list_tells_names_roles_and_states_and_no_secret(
    console: Console, capsys: pytest.CaptureFixture[str]
) -> None:
    console.call("add", "Eva", role="viewer", days=3)
    console.call("add", "Ana")
    capsys.readouterr()

    console.call("list")

    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "Ana  operator  invited"
    assert lines[1].startswith("Eva  viewer  invited, ends 20")


def test_nobody_is_called_as_somebody_else_or_as_nobody_can_be(
    console: Console,
) -> None:
    console.call("add", "Ana")

    with pytest.raises(NameTakenError):
        console.call("add", "ANA")
    with pytest.raises(NotANameError):
        console.call("add", "<b>")
    with pytest.raises(UnknownNameError):
        console.call("disable", "Eva")


def test_a_new_server_invites_its_first_admin_until_there_is_one(
    console: Console,
) -> None:
    now = clock.wall()
    first, second = set_up(console.store, now), set_up(console.store, now)
    assert first is not None
    assert second is not None
    taken = console.store.accept(digest_of(first), "#hash", now)
    begun = console.store.accept(digest_of(second), "#hash", now)

    # Each start makes a new link; the one before is none any more.
    assert taken is None
    assert begun is not None
    assert begun.role == "admin"
    assert set_up(console.store, now) is None
    assert console.store.accept(digest_of(second), "#hash", now) is None


def test_the_first_link_is_over_after_half_an_hour(console: Console) -> None:
    first = set_up(console.store, clock.wall())
    assert first is not None

    assert console.store.accept(digest_of(first), "#h", clock.wall() + 1801.0) is None


def test_a_programs_token_is_printed_once_listed_and_revoked(
    console: Console, capsys: pytest.CaptureFixture[str]
) -> None:
    console.call("token", "MES", scope="stop", days=2)
    token = capsys.readouterr().out.strip()
    tokens = ApiTokenStore(console.settings.database_url)
    kept = tokens.read()[digest_of(token)]
    tokens.used({kept.digest: 1_700_000_000.0})
    console.call("list")
    listed = capsys.readouterr().out
    console.call("revoke", "mes")

    assert (kept.name, kept.scope) == ("MES", "stop")
    used, ends = listed.splitlines()[-1].split(", ends ")
    assert used == "MES  program  stop  2023-11-14T22:13:20.000Z"
    assert kept.ends_at == kept.made_at + 2 * 86_400.0
    assert ends == format_stamp(kept.ends_at)
    assert token not in listed
    assert tokens.read() == {}
    with pytest.raises(UnknownNameError):
        console.call("revoke", "MES")
    tokens.close()
    url = console.settings.database_url
    assert ask_once(url, _actions) == ["token_added", "token_revoked"]


def _actions(connection: Connection) -> list[str]:
    return list(connection.scalars(text("SELECT action FROM audit ORDER BY seq")))
