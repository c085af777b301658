"""Incident packs: whole as they were made, and one changed byte is found."""

import zipfile
from pathlib import Path

import pytest

from iveg.adapters.incident_files import MANIFEST, verify_pack, write_pack
from iveg.domain.errors import DataFileError
from iveg.domain.incident import FoundFile, chained, faults


@pytest.fixture
def pack(tmp_path: Path) -> Path:
    recording = tmp_path / "recording.mcap"
    recording.write_bytes(bytes(range(256)) * 20)
    parts: list[tuple[str, bytes | Path]] = [
        ("report.en.html", b"<p>It stood.</p>"),
        ("rows/log.ndjson", b""),
        ("recording.mcap", recording),
    ]
    write_pack(tmp_path / "pack.zip", {"about": "decision D1"}, parts)
    return tmp_path / "pack.zip"


def rewritten(pack: Path, changes: dict[str, bytes | None]) -> Path:
    """The same pack with other contents; None: without that file."""
    other = pack.with_name("other.zip")
    with zipfile.ZipFile(pack) as old, zipfile.ZipFile(other, "w") as new:
        contents = {name: old.read(name) for name in old.namelist()}
        for name, content in (contents | changes).items():
            if content is not None:
                new.writestr(name, content)
    return other


def test_a_pack_is_whole_as_it_was_made(pack: Path) -> None:
    end, wrong = verify_pack(pack)
    assert wrong == []
    assert len(end) == 64


@pytest.mark.parametrize("place", [0, 700, 5119])
def test_one_changed_byte_of_a_file_is_found(pack: Path, place: int) -> None:
    with zipfile.ZipFile(pack) as whole:
        content = bytearray(whole.read("recording.mcap"))
    content[place] ^= 1
    _, wrong = verify_pack(rewritten(pack, {"recording.mcap": bytes(content)}))
    assert wrong == ["recording.mcap was changed."]


def test_every_byte_of_a_pack_that_is_changed_in_place_is_found(pack: Path) -> None:
    whole = pack.read_bytes()
    for place in range(0, len(whole), 7):
        broken = bytearray(whole)
        broken[place] ^= 0x10
        pack.write_bytes(broken)
        assert is_found(pack), place
    for more in (whole + b" ", b" " + whole):
        pack.write_bytes(more)
        assert is_found(pack)


def is_found(pack: Path) -> bool:
    try:
        return verify_pack(pack)[1] != []
    except DataFileError:
        return True


def test_what_is_missing_or_too_many_is_named(pack: Path) -> None:
    changes = {"rows/log.ndjson": None, "rows/new.ndjson": b"{}"}
    _, wrong = verify_pack(rewritten(pack, changes))
    assert wrong == [
        "rows/new.ndjson is not in the manifest.",
        "rows/log.ndjson is missing.",
    ]


def test_a_manifest_that_was_made_to_fit_has_another_end(pack: Path) -> None:
    end, _ = verify_pack(pack)
    found = {"report.en.html": b"<p>It did not stand.</p>", "rows/log.ndjson": b""}
    forged = pack.with_name("forged.zip")
    write_pack(forged, {"about": "decision D1"}, [*found.items()])
    other, wrong = verify_pack(forged)
    assert wrong == []
    assert other != end


def test_a_changed_manifest_is_found(pack: Path) -> None:
    with zipfile.ZipFile(pack) as whole:
        text = whole.read(MANIFEST)
    for old, new in ((b'"size": 0', b'"size": 1'), (b'"chain": "', b'"chain": "0')):
        _, wrong = verify_pack(rewritten(pack, {MANIFEST: text.replace(old, new, 1)}))
        assert any("manifest itself" in one for one in wrong)


@pytest.mark.parametrize(
    "content", [b"", b"no ZIP", None, b"{}", b"[]", b'{"format":9}']
)
def test_what_is_no_pack_is_told(pack: Path, content: bytes | None) -> None:
    if content in (b"", b"no ZIP"):
        pack.write_bytes(content or b"")
    else:
        pack = rewritten(pack, {MANIFEST: content})
    with pytest.raises(DataFileError, match="is no incident pack"):
        verify_pack(pack)


def test_the_order_of_files_counts() -> None:
    one, two = ("a", FoundFile(1, "aa")), ("b", FoundFile(2, "bb"))
    assert chained([one, two])[-1].chain != chained([two, one])[-1].chain
    swapped = [*reversed(chained([one, two]))]
    assert list(faults(swapped, dict([one, two]))) == [
        "The manifest itself was changed: its chain does not hold."
    ]
