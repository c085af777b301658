"""People and programs with accounts: what pages about them have to show."""

from playwright.sync_api import Browser, StorageState

from iveg.adapters import clock
from iveg.adapters.admission import Admission, admit_program
from iveg.adapters.history.accounts import AccountRows, AccountStore
from iveg.adapters.history.api_tokens import ApiTokenStore
from iveg.domain.accounts import TokenScope
from iveg.domain.audit import CONSOLE
from tests.processes import Site, until

_TOKENS: tuple[tuple[str, TokenScope], ...] = (
    ("climate-bridge", "read"),
    ("night-watch-of-the-cooperative", "stop"),
)


def signed_in_admin(browser: Browser, past: Site) -> StorageState:
    """The session of an admin of a site that also knows others; one look at it."""
    url, now = past.settings["IVEG_DATABASE_URL"], clock.wall()
    accounts, tokens = AccountStore(url), ApiTokenStore(url)

    def invite(rows: AccountRows) -> str:
        admission = Admission(rows, CONSOLE, now)
        admission.add("Antonio José Fernández", "operator", now + 7 * 86_400.0)
        admission.add("visita", "viewer")
        return admission.add("Eva Ruiz", "admin")[0]

    invitation = accounts.together(invite)
    for name, scope in _TOKENS:
        admit_program(tokens, name, scope, None, by=CONSOLE, now=now)
    accounts.close()
    tokens.close()
    context = browser.new_context(locale="es-ES")
    proof = {"invitation": invitation, "password": "berenjena-77"}
    headers = {"X-IVEG": "1", "Origin": past.url}

    def is_in() -> bool:
        # The server reads accounts twice a second, and five wrong tries cost a minute.
        context.pages or context.new_page()
        context.pages[0].wait_for_timeout(900)
        answer = context.request.post(f"{past.url}/signin", data=proof, headers=headers)
        return answer.status == 204

    until(is_in, 90.0, "the admin is signed in")
    state = context.storage_state()
    context.close()
    return state
