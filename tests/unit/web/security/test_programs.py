"""Programs with tokens of their own: scope, name, last use, and their end."""

import httpx
import pytest

from iveg.domain.accounts import ApiToken, TokenScope, digest_of
from iveg.domain.records import AuditRecord
from tests.unit.web.desk import API_TOKEN, WebDesk

SCOPES: tuple[TokenScope, ...] = ("read", "stop", "operate")


TOKENS = [
    ApiToken(scope, f"mes-{scope}", scope, digest_of(scope), 0) for scope in SCOPES
]


class ProgramsDesk(WebDesk):
    """A desk that programs with tokens of their own call."""

    def __init__(self) -> None:
        super().__init__()
        self.book.tokens.update({one.digest: one for one in TOKENS})

    def caller(self, token: str) -> httpx.AsyncClient:
        return self._client({"Authorization": f"Bearer {token}"})


@pytest.fixture
def desk() -> ProgramsDesk:
    return ProgramsDesk()


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


async def test_the_last_use_is_written_once_a_minute(desk: ProgramsDesk) -> None:
    began, kept = desk.clock().wall, list[float | None]()
    desk.book.on_keep.append(
        lambda: kept.append(desk.book.tokens[digest_of("read")].used_at)
    )
    async with desk.caller("read") as program:
        for _ in range(3):
            await program.get("/api/v1/robots")
            desk.clock.now += 59.0

    assert kept == [began, began + 118.0]
    assert desk.book.tokens[digest_of("stop")].used_at is None


async def test_a_revoked_token_is_nobodys_and_its_sockets_are_told(
    desk: ProgramsDesk,
) -> None:
    who = desk.people.program("operate")
    assert who is not None
    before = desk.authenticator.current(who)

    del desk.book.tokens[digest_of("operate")]

    assert before == who
    assert desk.people.program("operate") is None
    # `/live` asks this twice a second and closes.
    assert desk.authenticator.current(who) is None


_CHANGE = {"version": 1, "radius_m": 2.5}
