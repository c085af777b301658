"""No damage to any file or database changes the answer to STOP of who was in."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest

from iveg.domain.accounts import PersonRole
from tests.consoles import console
from tests.processes import NO_TLS, Program, Site, site, until

OWN = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
PASSWORD = "berenjena-77"
Callers = Mapping[str, httpx.Client]


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Site]:
    with site(tmp_path, IVEG_RECORDINGS="on") as place:
        yield place


@pytest.fixture
def callers(place: Site) -> Iterator[Callers]:
    """Everybody who can be in: by the link, by name in each role, by a token."""
    serve(place)
    admission = console(place.directory)
    token, _ = admission.give_token("MES", "stop")
    with ExitStack() as stack:

        def client(**headers: str) -> httpx.Client:
            return stack.enter_context(
                httpx.Client(
                    base_url=place.url,
                    headers=headers,
                    timeout=30.0,
                    trust_env=False,
                    verify=NO_TLS,
                )
            )

        found = {
            "token": client(Authorization=f"Bearer {token}"),
            "link": client(**OWN),
        }
        proof = {"token": place.settings["IVEG_SIGN_IN_TOKEN"]}
        assert found["link"].post("/signin", json=proof).status_code == 204
        people: dict[PersonRole, str] = {
            "viewer": "Eva",
            "operator": "Ana",
            "admin": "Luz",
        }
        invited = {role: admission.add(one, role)[0] for role, one in people.items()}
        left = "accounts.jsonl.left-*"
        until(lambda: not [*place.directory.glob(left)], "the server knows them")
        for role, invitation in invited.items():
            begun = {"invitation": invitation, "password": PASSWORD}
            found[role] = client(**OWN)
            assert found[role].post("/signin", json=begun).status_code == 204
        yield found


def serve(place: Site) -> Program:
    program = place.start("serve")
    place.wait_until_served()
    return program


def answers(callers: Callers) -> dict[str, int]:
    return {
        who: page.post("/api/v1/robots/AGI/stop").status_code
        for who, page in callers.items()
    }


def _overwrite(path: Path) -> None:
    size = max(path.stat().st_size, 4096)
    path.write_bytes((b"\xa5junk\x00\n" * (size // 6 + 1))[:size])


def _fold(path: Path) -> None:
    path.unlink()
    path.mkdir()
    (path / "inside").touch()


DAMAGE: dict[str, Callable[[Path], object]] = {
    "emptied": lambda path: path.write_bytes(b""),
    "halved": lambda path: path.write_bytes(
        path.read_bytes()[: path.stat().st_size // 2]
    ),
    "junk": _overwrite,
    "deleted": Path.unlink,
    "a folder": _fold,
}
ALL_IN = dict.fromkeys(("token", "link", "viewer", "operator", "admin"), 202)


def test_f21_whoever_was_in_stops_whatever_becomes_of_the_files_while_iveg_runs(
    place: Site, callers: Callers
) -> None:
    files = [one for one in place.directory.rglob("*") if one.is_file()]
    readable = [one.name for one in files if one.stat().st_mode & 0o077]
    said, damaged = {}, set()
    for name, damage in DAMAGE.items():
        for path in sorted(place.directory.rglob("*")):
            if path.is_file() and path.suffix != ".log":
                damage(path)
                damaged.add(path.name)
        said[name] = answers(callers)
        anew = f"accounts.jsonl is written anew after it was {name}"
        until(lambda: (place.directory / "accounts.jsonl").is_file(), anew)
        said[f"{name}, later"] = answers(callers)

    assert {case: one for case, one in said.items() if one != ALL_IN} == {}
    assert [one for one in readable if not one.endswith(".log")] == []
    assert damaged > {"accounts.jsonl", "commands.jsonl", "history.sqlite"}


def test_what_is_whole_in_a_damaged_file_is_in_after_a_restart_with_a_dead_database(
    place: Site, callers: Callers
) -> None:
    path = place.directory / "accounts.jsonl"
    until(lambda: path.read_bytes().count(b'"session"') == 4, "all are on disk")
    place.programs[-1].kill()
    # In the middle of the file stands a line that is no record.
    lines = path.read_bytes().splitlines(keepends=True)
    sessions = [n for n, one in enumerate(lines) if b'"session"' in one]
    (of_eva,) = (n for n in sessions if b"Eva" in lines[n])
    lines[of_eva] = lines[of_eva].replace(b"Eva", b"E\xa5a")
    path.write_bytes(b"".join(lines[:-1]))
    _overwrite(place.directory / "history.sqlite")

    serve(place)
    said = answers(callers)
    with place.api() as program:
        ready = program.get(f"{place.url}/readyz")
        priority = until(
            lambda: {
                one["key"]: one["priority"]
                for one in program.get("alerts").json()["items"]
            }.get("alert.accounts_damaged"),
            "the alert",
        )

    assert said == ALL_IN | {"viewer": 401}
    assert (ready.status_code, ready.json()["accounts"]) == (503, "damaged")
    assert priority == "P1"


def test_who_was_shut_out_is_out_after_a_crash_of_the_next_moment(
    place: Site, callers: Callers
) -> None:
    admin = callers["admin"]
    users = {one["name"]: one for one in admin.get("/api/v1/users").json()["items"]}
    off = admin.post(f"/api/v1/users/{users['Ana']['user_id']}/disable", json={})
    revoked = admin.delete("/api/v1/tokens/" + _token_id(admin))
    text = place.directory / "accounts.jsonl"
    until(lambda: b'"MES"' not in text.read_bytes(), "the revocation is on disk", 2.0)
    place.programs[-1].kill()

    serve(place)

    assert (off.status_code, revoked.status_code) == (200, 204)
    assert answers(callers) == ALL_IN | {"operator": 401, "token": 401}


def _token_id(admin: httpx.Client) -> str:
    (only,) = admin.get("/api/v1/tokens").json()["items"]
    return str(only["token_id"])
