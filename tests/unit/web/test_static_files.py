"""A file of the page comes from memory, and is answered like one that is read."""

import os
from pathlib import Path

import httpx
import pytest
from starlette.applications import Starlette
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles

from iveg.web.static_files import KeptFiles

Client = httpx.AsyncClient

OLD, NEW = "let beat = 1;\n", "let beat = 2;\n"
CHANGED_NS = 1_700_000_000_000_000_000
OUTSIDE = "not for the page"
ASKED: tuple[dict[str, str], ...] = (
    {},
    {"If-None-Match": '"of another file"'},
    {"If-None-Match": "*"},
    {"If-Modified-Since": "Wed, 01 Jan 2070 00:00:00 GMT"},
    {"Range": "bytes=4-7"},
    {"Range": "bytes=999-"},
)
"""Headers of requests for a file."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with one script, and something beside it."""
    (tmp_path / "secret.js").write_text(OUTSIDE)
    scripts = tmp_path / "static" / "js"
    scripts.mkdir(parents=True)
    _write(scripts / "main.js", OLD)
    return tmp_path / "static"


@pytest.fixture
def client(folder: Path) -> Client:
    """Of an application that keeps files, beside one that reads each anew."""
    kept = Mount("/static", KeptFiles(folder))
    fresh = Mount("/fresh", StaticFiles(directory=folder))
    transport = httpx.ASGITransport(Starlette(routes=[kept, fresh]))
    return Client(transport=transport, base_url="http://iveg.test")


def _write(file: Path, text: str) -> None:
    file.write_text(text)
    os.utime(file, ns=(CHANGED_NS, CHANGED_NS))


@pytest.mark.parametrize("method", ["GET", "HEAD", "POST"])
@pytest.mark.parametrize(
    "path", ["js/main.js", "js", "", "js/none.js", "%2e%2e/secret.js", "js/%00"]
)
async def test_an_answer_is_that_of_a_file_that_is_read_for_it(
    client: Client, path: str, method: str
) -> None:
    for asked in ASKED:
        fresh = await client.request(method, f"/fresh/{path}", headers=asked)
        wanted = (fresh.status_code, fresh.headers, fresh.content)
        for _ in range(2):
            kept = await client.request(method, f"/static/{path}", headers=asked)

            assert (kept.status_code, kept.headers, kept.content) == wanted, asked
            assert OUTSIDE not in kept.text


async def test_a_file_is_read_once(client: Client, folder: Path) -> None:
    first = await client.get("/static/js/main.js")
    _write(folder / "js/main.js", NEW)

    assert (first.text, (await client.get("/static/js/main.js")).text) == (OLD, OLD)
