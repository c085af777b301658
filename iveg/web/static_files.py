"""The page's own files from memory: a page asks for some 200 of them at once.

Opened and read anew in threads for each request, they would hold up the loop on which a
STOP runs for twice as long.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from stat import S_ISREG

from anyio import to_thread
from starlette.datastructures import Headers
from starlette.responses import FileResponse, Response
from starlette.staticfiles import NotModifiedResponse, StaticFiles
from starlette.types import Scope


@dataclass(frozen=True, slots=True)
class _Kept:
    """A file as it was read.

    Attributes:
        version: Time of its last change (ns) and size (bytes).
        headers: Of an answer that holds the whole file.
    """

    file: str
    version: tuple[int, int]
    headers: Headers
    content: bytes

    def is_current(self) -> bool:
        """Whether the file has been neither changed nor taken away."""
        try:
            return _version(Path(self.file).stat()) == self.version
        except OSError:
            return False


class KeptFiles(StaticFiles):
    """The files of a folder; each is read when it is first asked for or has changed."""

    def __init__(self, folder: Path) -> None:
        super().__init__(directory=folder)
        self._kept: dict[str, _Kept] = {}

    async def get_response(self, path: str, scope: Scope) -> Response:
        """A whole file from memory; any other answer is the framework's own."""
        asked = Headers(scope=scope)
        if scope["method"] != "GET" or "range" in asked:
            return await super().get_response(path, scope)
        kept = self._kept.get(path)
        if kept is None or not kept.is_current():
            kept = await to_thread.run_sync(self._read, path)
        if kept is None:
            return await super().get_response(path, scope)
        self._kept[path] = kept
        if self.is_not_modified(kept.headers, asked):
            return NotModifiedResponse(kept.headers)
        return Response(kept.content, headers=kept.headers)

    def _read(self, path: str) -> _Kept | None:
        """None for what is no file, or was just being written."""
        try:
            file, found = self.lookup_path(path)
            if found is None or not S_ISREG(found.st_mode):
                return None
            content = Path(file).read_bytes()
        except (OSError, ValueError):
            return None
        headers = FileResponse(file, stat_result=found).headers
        is_whole = len(content) == found.st_size
        return _Kept(file, _version(found), headers, content) if is_whole else None


def _version(found: os.stat_result) -> tuple[int, int]:
    return found.st_mtime_ns, found.st_size
