"""A full disk below the whole stack, on a file system of its own.

``make chaos`` runs it, where a small file system can be mounted: as root.
"""

import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import httpx
import pytest

from tests.chaos.field import Field
from tests.chaos.person import Person
from tests.chaos.witness import Witness
from tests.processes import Site, until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(400),
    pytest.mark.skipif("IVEG_CHAOS_DISK" not in os.environ, reason="make chaos"),
]
SIZE_MIB, RECORDING_MIB = 48, 3
LOOKS_WITHIN_S = 90.0
"""The guard looks once a minute."""
WITHIN_S = 40.0


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    small = tmp_path / "small"
    small.mkdir()
    size = f"size={SIZE_MIB}m"
    mount = ["mount", "-t", "tmpfs", "-o", size, "none", str(small)]
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("a file system can be mounted by root alone")
    yield small
    subprocess.run(["/usr/bin/umount", "--lazy", str(small)], check=True)


@pytest.fixture
def field(tmp_path: Path, disk: Path) -> Iterator[Field]:
    place = Site(
        tmp_path,
        {
            "IVEG_DATABASE_URL": f"sqlite:///{disk / 'history.sqlite'}",
            "IVEG_RECORDINGS": "on",
        },
    )
    for one in _earlier(disk):
        one.parent.mkdir(exist_ok=True)
        one.write_bytes(bytes(RECORDING_MIB << 20))
    found = Field(place, "--held", "--scenario", "peers")
    try:
        found.start_all()
        yield found
    finally:
        place.stop_all()
        found.close()


def _earlier(disk: Path) -> list[Path]:
    """Two finished recordings of the hours before this, the older first."""
    began = (time.time() // 3600 * 3600 - ago * 3600 for ago in (2, 1))
    names = (time.strftime("%FT%H-%M-%SZ.mcap", time.gmtime(at)) for at in began)
    return [disk / "recordings" / name for name in names]


def _fill(ballast: Path) -> None:
    """Leave no byte free."""
    with ballast.open("wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(4096))


def test_on_a_full_disk_stop_goes_on_and_the_oldest_recording_goes_first(
    field: Field, disk: Path
) -> None:
    token = field.place.settings["IVEG_API_TOKEN"]
    head = {"Authorization": f"Bearer {token}"}
    with (
        Witness(field.port) as witness,
        httpx.Client(base_url=field.place.url, headers=head) as program,
    ):
        person = Person(field.place, witness)
        person.let_go("AGI")
        oldest, newer = _earlier(disk)
        assert oldest.exists()
        _fill(disk / "ballast")
        assert os.statvfs(disk).f_bavail == 0

        pressed = time.time()
        assert person.press("AGI")
        person.wait_for("AGI", "STANDING")

        # The history cannot always be read meanwhile; the page has its alerts live.
        def told() -> bool:
            answer = program.get("/api/v1/alerts").json()
            keys = [(one["priority"], one["key"]) for one in answer.get("items", ())]
            return ("P2", "alert.disk_low") in keys

        until(told, "people are told", LOOKS_WITHIN_S)
        until(lambda: not oldest.exists(), "the oldest recording goes", LOOKS_WITHIN_S)
        assert newer.exists()
        robot = person.look("AGI")
        assert robot is not None
        assert robot["link"] == "LIVE"

        (disk / "ballast").unlink()

        def kept() -> bool:
            since = {"since": f"{time.strftime('%FT%TZ', time.gmtime(pressed - 1))}"}
            answer = program.get("/api/v1/commands", params=since).json()
            return any(one["state"] == "STANDING" for one in answer.get("items", ()))

        until(kept, "what waited for the disk is in the history", WITHIN_S)
        assert witness.unlicensed == 0
        person.close()
