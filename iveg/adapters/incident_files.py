"""Incident packs on disk: a ZIP of files with a manifest, written and verified."""

import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from hashlib import file_digest, sha256
from io import BytesIO, RawIOBase
from pathlib import Path
from typing import IO

import orjson
from pydantic import TypeAdapter, ValidationError
from typing_extensions import Buffer

from iveg.domain.errors import DataFileError
from iveg.domain.incident import FoundFile, PackedFile, chained, faults

MANIFEST = "manifest.json"
_FORMAT = 1
_BLOCK = 1 << 20
_LARGEST_MANIFEST = 1 << 20
_UNREADABLE = (zipfile.BadZipFile, zlib.error, OSError, EOFError, RuntimeError)
_PACKED = TypeAdapter(tuple[PackedFile, ...])


class _Stream(RawIOBase):
    """Where a ZIP is written from its first byte to its last.

    Attributes:
        digest: SHA-256 of all bytes.
    """

    def __init__(self, target: IO[bytes] | None) -> None:
        super().__init__()
        self.digest = sha256()
        self._target = target

    def writable(self) -> bool:
        """Nothing else can be done with it."""
        return True

    def write(self, data: Buffer) -> int:
        """Take bytes; returns how many."""
        self.digest.update(data)
        if self._target is not None:
            self._target.write(data)
        return memoryview(data).nbytes


def write_pack(
    target: Path, facts: Mapping[str, object], parts: Iterable[tuple[str, bytes | Path]]
) -> str:
    """Write a pack; returns the end of its chain.

    Args:
        target: The ZIP.
        facts: Stand in the manifest beside the files.
        parts: Name and content of each, in their order.

    Raises:
        OSError: the disk is full or away.
    """
    found = []
    with target.open("wb") as file, zipfile.ZipFile(_Stream(file), "w") as pack:
        for name, content in parts:
            with _opened(content) as stream:
                found.append((name, _add(pack, name, stream)))
        files = chained(found)
        end = files[-1].chain if files else ""
        manifest = {"format": _FORMAT, **facts, "files": [asdict(one) for one in files]}
        text = orjson.dumps({**manifest, "chain": end}, option=orjson.OPT_INDENT_2)
        _add(pack, MANIFEST, BytesIO(text))
    return end


def verify_pack(path: Path) -> tuple[str, list[str]]:
    """The end of a pack's chain, and what is wrong with it; nothing: it is whole.

    Raises:
        DataFileError: it is no pack at all.
    """
    found, wrong = {}, []
    again = _Stream(None)
    try:
        with zipfile.ZipFile(path) as pack, zipfile.ZipFile(again, "w") as rewritten:
            manifest, end = _manifest(path, pack)
            for name in pack.namelist():
                try:
                    with pack.open(name) as stream:
                        found[name] = _add(rewritten, name, stream)
                except _UNREADABLE as error:
                    wrong.append(f"{name} cannot be read: {error}.")
    except _UNREADABLE as error:
        raise DataFileError(str(path), "", f"is no incident pack: {error}.") from error
    del found[MANIFEST]
    wrong += faults(manifest, found)
    if (manifest[-1].chain if manifest else "") != end:
        wrong.append("The manifest itself was changed: its end is another.")
    with path.open("rb") as stream:
        if (
            not wrong
            and file_digest(stream, sha256).hexdigest() != again.digest.hexdigest()
        ):
            wrong.append("Bytes between its files were changed.")
    return end, wrong


def _manifest(path: Path, pack: zipfile.ZipFile) -> tuple[tuple[PackedFile, ...], str]:
    reason = "is no incident pack: it has no manifest of this format."
    try:
        with pack.open(MANIFEST) as stream:
            manifest = orjson.loads(stream.read(_LARGEST_MANIFEST))
        if manifest["format"] != _FORMAT:
            raise DataFileError(str(path), MANIFEST, reason)
        return _PACKED.validate_python(manifest["files"]), str(manifest["chain"])
    except (KeyError, TypeError, ValueError, ValidationError) as error:
        raise DataFileError(str(path), MANIFEST, reason) from error


@contextmanager
def _opened(content: bytes | Path) -> Iterator[IO[bytes]]:
    with content.open("rb") if isinstance(content, Path) else BytesIO(content) as found:
        yield found


def _add(pack: zipfile.ZipFile, name: str, stream: IO[bytes]) -> FoundFile:
    """Add a file as it is, without a date: the same files make the same pack."""
    digest, size = sha256(), 0
    with pack.open(zipfile.ZipInfo(name), "w", force_zip64=True) as target:
        while block := stream.read(_BLOCK):
            digest.update(block)
            size += target.write(block)
    return FoundFile(size, digest.hexdigest())
