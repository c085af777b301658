"""Single sign-on from the browser's side: who comes in, as whom, and who does not."""

import asyncio
import logging
from collections.abc import AsyncIterator
from dataclasses import replace
from urllib.parse import quote

import httpx
import pytest

from iveg.adapters.identity_provider import Client
from iveg.adapters.oidc import OpenIdProvider
from iveg.domain.accounts import Account, ClaimReading, person_id
from iveg.domain.records import AuditRecord
from iveg.web.pages.contexts import Site
from iveg.web.pages.drawing import Pages
from iveg.web.pages.routes import router
from iveg.web.security.roles import Principal
from iveg.web.security.sessions import LASTS_S
from iveg.web.security.single_sign_on import SingleSignOn
from tests.fakes.identity_provider import (
    CLIENT,
    KEYCLOAK,
    SECRET,
    FakeIdentityProvider,
    own_url,
    serving,
)
from tests.unit.web.desk import HOST, WebDesk

OWN = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
PAGES = {"Accept": "text/html", "Accept-Language": "en"}
LOCAL = Account("P1", "Ada", "admin", password="#acelga-1234")
CALLBACK = f"http://{HOST}/signin/sso/callback"


class SignOnDesk(WebDesk):
    """A desk with a provider beside its accounts."""

    def __init__(self) -> None:
        super().__init__()
        self.provider = FakeIdentityProvider(own_url(), {"ana-1": dict(KEYCLOAK)})
        self.book.accounts["P1"] = LOCAL
        client = Client(self.provider.url, CLIENT, SECRET, "openid")
        reading = ClaimReading("realm_access.roles", "name", {"growers": "operator"})
        self.sign_on = SingleSignOn(OpenIdProvider(client), reading, self.authenticator)
        site = Site("field", ("AGI", "AGII"), "1", demo=False, sso="Cooperativa")
        pages = Pages(site)
        self.app.include_router(
            router(pages, rule=lambda: self.rules.current, sign_on=self.sign_on)
        )
        self.person = person_id(self.provider.url, "ana-1")

    def page(self) -> httpx.AsyncClient:
        return self._client(OWN)

    async def approved(self, page: httpx.AsyncClient, path: str = "/signin/sso") -> str:
        """Where the provider's page sends Ana back to."""
        sent = await page.get(path)
        assert sent.status_code == 303, sent.text
        return self.provider.approve(sent.headers["location"], "ana-1")

    async def through(
        self, page: httpx.AsyncClient, path: str = "/signin/sso"
    ) -> httpx.Response:
        """Sign in on the provider's page."""
        return await page.get(await self.approved(page, path), headers=PAGES)

    def who(self, page: httpx.AsyncClient) -> Principal | None:
        cookie = page.cookies.get("iveg")
        return None if cookie is None else self.authenticator.sessions.find(cookie)


@pytest.fixture
async def desk() -> AsyncIterator[SignOnDesk]:
    desk = SignOnDesk()
    async with serving(desk.provider):
        yield desk
    await desk.sign_on._provider.close()


async def test_whom_the_provider_vouches_for_is_in_by_name_role_and_stable_id(
    desk: SignOnDesk,
) -> None:
    async with desk.page() as page:
        entered = await desk.through(page, "/signin/sso?to=/alerts?open=1")
        who = desk.who(page)
        stopped = await page.post("/api/v1/robots/AGI/stop")

    assert entered.status_code == 200
    assert entered.headers["refresh"] == "0; url=/alerts?open=1"
    assert who is not None
    known = (who.name, who.role, who.person, who.method)
    assert known == ("Ana Núñez", "operator", desk.person, "sso")
    assert stopped.status_code == 202
    (command,) = desk.commander.commands.values()
    assert command.requesters == ("Ana Núñez",)
    row = desk.records(AuditRecord)[0]
    assert (row.action, row.method) == ("sign_in", "sso")
    assert desk.book.accounts[desk.person].provider == desk.provider.url


@pytest.mark.parametrize(
    "to",
    [
        "//evil.test",
        "/\\evil.test",
        "https://evil.test",
        "/a\r\nSet-Cookie: x=1",
        "",
        "/" + "a" * 501,
    ],
)
async def test_the_way_back_leads_to_own_paths_alone(desk: SignOnDesk, to: str) -> None:
    async with desk.page() as page:
        entered = await desk.through(page, f"/signin/sso?to={quote(to)}")

    assert entered.headers["refresh"] == "0; url=/"


async def test_who_has_no_mapped_role_is_told_so_and_is_not_in(
    desk: SignOnDesk,
) -> None:
    desk.provider.people["ana-1"] = {**KEYCLOAK, "realm_access": {"roles": ["guest"]}}
    async with desk.page() as page:
        refused = await desk.through(page)

        assert desk.who(page) is None
    assert refused.status_code == 403
    assert "gives you no role in iVeg" in refused.text
    assert "Cooperativa" in refused.text
    (row,) = desk.records(AuditRecord)
    assert (row.action, row.method) == ("sign_in_refused", "none")
    assert '"why":"no_role"' in row.details
    assert desk.book.accounts == {"P1": LOCAL}


async def test_an_answer_counts_once_in_its_own_browser_and_for_ten_minutes(
    desk: SignOnDesk,
) -> None:
    async with desk.page() as page, desk.page() as other:
        back = await desk.approved(page)
        entered = await page.get(back)
        again = await page.get(back)

        await other.get("/signin/sso")
        back = await desk.approved(page)
        stolen = await other.get(back)
        # It is left to the browser that began.
        own = await page.get(back)

        late = await desk.approved(page)
        desk.clock.now += 601.0
        over = await page.get(late)
        made_up = await page.get(f"{CALLBACK}?code=x&state=x")

        assert desk.who(other) is None
    assert [one.status_code for one in (entered, own)] == [200, 200]
    # The provider itself takes a code once.
    assert again.status_code == 403
    assert [one.status_code for one in (stolen, over, made_up)] == [400] * 3
    assert desk.provider.asked.count("/token") == 3


@pytest.mark.parametrize(
    ("query", "why"),
    [
        ({"error": "access_denied"}, "refused"),
        ({"error": "x\n<b>" * 40}, "refused"),
        ({}, "untrusted"),
        ({"code": "guessed"}, "untrusted"),
    ],
)
async def test_an_answer_that_proves_nothing_is_told_with_its_cause(
    desk: SignOnDesk, query: dict[str, str], why: str
) -> None:
    async with desk.page() as page:
        sent = await page.get("/signin/sso")
        state = httpx.URL(sent.headers["location"]).params["state"]
        refused = await page.get(CALLBACK, params={**query, "state": state})

        assert desk.who(page) is None
    assert refused.status_code == 403
    assert 'id="signin-sso"' in refused.text
    assert "<b>" not in refused.text
    (row,) = desk.records(AuditRecord)
    assert f'"why":"{why}"' in row.details


async def test_who_is_disabled_here_is_out_at_once_and_stays_out(
    desk: SignOnDesk,
) -> None:
    async with desk.page() as page:
        await desk.through(page)
        before = desk.who(page)
        known = desk.book.accounts
        known[desk.person] = replace(known[desk.person], disabled=True)
        stopped = await page.post("/api/v1/robots/AGI/stop")
        again = await desk.through(page)

    assert before is not None
    assert stopped.status_code == 401
    assert again.status_code == 403
    assert "shut out" in again.text


async def test_with_the_provider_down_a_local_admin_signs_in_and_releases(
    desk: SignOnDesk,
) -> None:
    desk.provider.vice = "away"
    async with desk.page() as page:
        down = await page.get("/signin/sso", headers=PAGES)
        proof = {"name": "Ada", "password": "acelga-1234"}
        entered = await page.post("/signin", json=proof)
        stopped = await page.post("/api/v1/robots/AGI/stop")
        released = await page.post(
            "/api/v1/robots/AGI/release", json={"holds": [], "confirmed": True}
        )

    assert down.status_code == 503
    assert "did not answer" in down.text
    assert (entered.status_code, stopped.status_code) == (204, 202)
    # Whatever the robot says to it: it was no question of rights.
    assert released.status_code not in (401, 403)


async def test_a_session_of_the_provider_ends_in_time_and_leaves_stop(
    desk: SignOnDesk,
) -> None:
    async with desk.page() as page:
        await desk.through(page)
        desk.clock.now += LASTS_S - 1.0
        before = await page.get("/api/v1/robots")
        desk.clock.now += 2.0
        after = await page.get("/api/v1/robots")
        stopped = await page.post("/api/v1/robots/AGI/stop")

    statuses = [one.status_code for one in (before, after, stopped)]
    assert statuses == [200, 403, 202]


async def test_a_provider_that_hangs_holds_up_neither_stop_nor_more_than_eight(
    desk: SignOnDesk,
) -> None:
    desk.provider.vice = "slow"
    async with desk.page() as page:
        hanging = [asyncio.create_task(page.get("/signin/sso")) for _ in range(8)]
        while not desk.sign_on._exchanges.locked():  # noqa: ASYNC110
            await asyncio.sleep(0)
        one_more = await page.get("/signin/sso")
        cookie = desk.authenticator.sessions.open("Ada", "operator")
        stopped = await page.post(
            "/api/v1/robots/AGI/stop", headers={"Cookie": f"iveg={cookie}"}
        )
        for task in hanging:
            task.cancel()
        await asyncio.gather(*hanging, return_exceptions=True)

    assert one_more.status_code == 429
    assert stopped.status_code == 202


async def test_neither_log_nor_audit_holds_a_token_a_code_or_a_secret(
    desk: SignOnDesk, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "iveg")
    async with desk.page() as page:
        await desk.through(page)
        desk.provider.vice = "foreign_key"
        await desk.through(page)

    details = [row.details for row in desk.records(AuditRecord)]
    told = "".join([caplog.text, *details])
    codes = [form["code"] for form in desk.provider.forms]
    verifiers = [form["code_verifier"] for form in desk.provider.forms]
    assert len(codes) == 2
    assert "sign-in refused" in told
    secret = [SECRET, "eyJ", *codes, *verifiers]
    assert [one for one in secret if one in told] == []
