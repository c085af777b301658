"""Programs with tokens of their own: scope, name, last use, and their end."""

from collections.abc import AsyncIterator, Mapping
from dataclasses import replace

import httpx
import pytest

from iveg.domain.accounts import ApiToken, TokenScope, digest_of, name_key
from iveg.domain.audit import Actor
from iveg.domain.errors import HopError, NameTakenError
from iveg.domain.records import AuditRecord
from iveg.web.security.authentication import Authenticator
from iveg.web.security.programs import Programs
from tests.unit.web.desk import API_TOKEN, WebDesk

SCOPES: tuple[TokenScope, ...] = ("read", "stop", "operate")


class FakeTokens:
    """Implements ``web.security.programs.ApiTokens``."""

    def __init__(self) -> None:
        self.known = {
            digest_of(scope): ApiToken(
                scope, f"mes-{scope}", scope, digest_of(scope), 0
            )
            for scope in SCOPES
        }

        self.changes: list[tuple[str, str, str]] = []
        self.is_away = False

    def read(self) -> Mapping[str, ApiToken]:
        if self.is_away:
            raise HopError("database", "away")
        return dict(self.known)

    def add(self, token: ApiToken, by: Actor) -> None:
        if name_key(token.name) in {name_key(one.name) for one in self.known.values()}:
            raise NameTakenError(token.name)
        self.known[token.digest] = token
        self.changes.append(("token_added", token.name, by.name))

    def revoke(self, name: str, by: Actor) -> None:
        gone = next(one for one in self.known.values() if one.name == name)
        del self.known[gone.digest]
        self.changes.append(("token_revoked", name, by.name))

    def used(self, digests: Mapping[str, float]) -> None:
        for digest, at in digests.items():
            self.known[digest] = replace(self.known[digest], used_at=at)


class ProgramsDesk(WebDesk):
    """A desk that programs with tokens of their own call."""

    def __init__(self) -> None:
        super().__init__()
        self.tokens = FakeTokens()
        self.programs = Programs(self.tokens, self.clock)
        # The app's middleware knows this one, too.
        self.authenticator._programs = self.programs

    def caller(self, token: str) -> httpx.AsyncClient:
        return self._client({"Authorization": f"Bearer {token}"})


@pytest.fixture
async def desk() -> AsyncIterator[ProgramsDesk]:
    desk = ProgramsDesk()
    await desk.programs.refresh()
    yield desk
    desk.programs.close()


@pytest.mark.parametrize(
    ("token", "statuses"),
    [
        ("read", [200, 403, 403]),
        ("stop", [200, 202, 403]),
        ("operate", [200, 202, 200]),
        (API_TOKEN, [200, 202, 403]),
        ("other", [401, 401, 401]),
        ("", [401, 401, 401]),
    ],
)
async def test_a_scope_allows_what_it_says_and_no_more(
    desk: ProgramsDesk, token: str, statuses: list[int]
) -> None:
    async with desk.caller(token) as program:
        told = [
            (await program.get("/api/v1/robots")).status_code,
            (await program.post("/api/v1/robots/AGI/stop")).status_code,
            (await program.put("/api/v1/rule", json=_CHANGE)).status_code,
        ]

    assert told == statuses


async def test_a_program_acts_by_its_own_name(desk: ProgramsDesk) -> None:
    async with desk.caller("stop") as program:
        await program.post("/api/v1/robots/AGI/stop")

    (command,) = desk.commander.commands.values()
    (row,) = desk.records(AuditRecord)
    assert command.requesters == ("mes-stop",)
    assert (row.person, row.name, row.method) == ("stop", "mes-stop", "token")


async def test_the_last_use_is_kept_once_a_minute(desk: ProgramsDesk) -> None:
    async with desk.caller("read") as program:
        await program.get("/api/v1/robots")
        used_at = desk.clock().wall
        await desk.programs.refresh()
        early = desk.tokens.known[digest_of("read")].used_at
        desk.clock.now += 60.0
        await desk.programs.refresh()

    assert early is None
    assert desk.tokens.known[digest_of("read")].used_at == used_at
    assert desk.tokens.known[digest_of("stop")].used_at is None


async def test_a_revoked_token_is_nobodys_and_its_sockets_are_told(
    desk: ProgramsDesk,
) -> None:
    who = desk.programs.find("operate")
    assert who is not None
    before = desk.authenticator.current(who)

    del desk.tokens.known[digest_of("operate")]
    await desk.programs.refresh()

    assert before == who
    assert desk.programs.find("operate") is None
    # `/live` asks this twice a second and closes.
    assert desk.authenticator.current(who) is None


async def test_a_token_ends_by_itself_with_its_sockets(desk: ProgramsDesk) -> None:
    (digest,) = (
        one for one, known in desk.tokens.known.items() if known.name == "mes-stop"
    )
    ends_at = desk.clock().wall + 60.0
    desk.tokens.known[digest] = replace(desk.tokens.known[digest], ends_at=ends_at)
    await desk.programs.refresh()
    who = desk.programs.find("stop")
    assert who is not None
    async with desk.caller("stop") as program:
        before = await program.post("/api/v1/robots/AGI/stop")
        desk.clock.now += 60.0
        after = await program.post("/api/v1/robots/AGI/stop")

    assert (before.status_code, after.status_code) == (202, 401)
    # `/live` asks this twice a second and closes.
    assert desk.authenticator.current(who) is None


async def test_without_tokens_of_their_own_the_one_token_stays(
    desk: ProgramsDesk,
) -> None:
    alone = Authenticator(sign_in_token="", api_token=API_TOKEN, clock=desk.clock)
    program = alone._program(API_TOKEN)

    assert program is not None
    assert alone.current(program) == program
    assert alone._program("other") is None


_CHANGE = {"version": 1, "radius_m": 2.5}
