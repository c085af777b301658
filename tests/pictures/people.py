"""People and programs with accounts: what pages about them have to show."""

from dataclasses import dataclass

from playwright.sync_api import APIRequestContext, Browser, StorageState

from iveg.adapters import clock
from iveg.adapters.admission import Admission
from iveg.adapters.history.accounts import AccountRows, AccountStore
from iveg.adapters.history.api_tokens import ApiTokenStore
from iveg.adapters.program_admission import admit_program
from iveg.domain.accounts import TokenScope
from iveg.domain.audit import CONSOLE
from tests.pictures.pages import OWN, PIN
from tests.processes import Site, until

_TOKENS: tuple[tuple[str, TokenScope], ...] = (
    ("climate-bridge", "read"),
    ("night-watch-of-the-cooperative", "stop"),
)


_ADMIN = {"name": "Eva Ruiz", "password": "berenjena-77"}


@dataclass(frozen=True, slots=True)
class Sessions:
    """Of an admin, and of a shared tablet that she has made and can unlock."""

    admin: StorageState
    tablet: StorageState


def signed_in(browser: Browser, past: Site) -> Sessions:
    """The sessions of a site that also knows others."""
    invitation = _people(past)
    admin = _signed_in(
        browser, past, {"invitation": invitation, "password": _ADMIN["password"]}
    )
    return Sessions(admin, _signed_in(browser, past, _ADMIN, is_tablet=True))


def _people(past: Site) -> str:
    """Accounts and programs; the admin's invitation."""
    url, now = past.settings["IVEG_DATABASE_URL"], clock.wall()
    accounts, tokens = AccountStore(url), ApiTokenStore(url)

    def invite(rows: AccountRows) -> str:
        admission = Admission(rows, CONSOLE, now)
        admission.add("Antonio José Fernández", "operator", now + 7 * 86_400.0)
        admission.add("visita", "viewer")
        return admission.add(_ADMIN["name"], "admin")[0]

    invitation = accounts.together(invite)
    for name, scope in _TOKENS:
        admit_program(tokens, name, scope, None, by=CONSOLE, now=now)
    accounts.close()
    tokens.close()
    return invitation


def _signed_in(
    browser: Browser, past: Site, proof: dict[str, str], *, is_tablet: bool = False
) -> StorageState:
    """One look at a session."""
    context = browser.new_context(locale="es-ES")
    headers = {**OWN, "Origin": past.url}

    def is_in() -> bool:
        # The server reads accounts twice a second, and five wrong tries cost a minute.
        context.pages or context.new_page()
        context.pages[0].wait_for_timeout(900)
        answer = context.request.post(f"{past.url}/signin", data=proof, headers=headers)
        return answer.status == 204

    until(is_in, "the admin is signed in")
    if is_tablet:
        _make_tablet(context.request, past.url)
    state = context.storage_state()
    context.close()
    return state


def _make_tablet(asked: APIRequestContext, url: str) -> None:
    pin = asked.put(f"{url}/api/v1/account/pin", data={"pin": PIN}, headers=OWN)
    made = asked.post(f"{url}/api/v1/tablet", data={"name": "Nave 2"}, headers=OWN)
    assert (pin.status, made.status) == (204, 201)
