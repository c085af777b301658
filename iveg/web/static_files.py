"""Scripts, styles and images of the page, kept in memory."""

from pathlib import Path
from stat import S_ISREG

from anyio import to_thread
from starlette.datastructures import Headers
from starlette.responses import FileResponse, Response
from starlette.staticfiles import NotModifiedResponse, StaticFiles
from starlette.types import Scope


class KeptFiles(StaticFiles):
    """Files of a folder, kept in memory from their first request on.

    A page requests some 200 files at once.  Opened in threads for each request, they
    would hold up the loop, on which a STOP runs, for twice as long.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(directory=folder)
        self._kept: dict[str, Response] = {}

    async def get_response(self, path: str, scope: Scope) -> Response:
        """A whole file from memory; any other answer is the framework's own."""
        request = Headers(scope=scope)
        if scope["method"] != "GET" or "range" in request:
            return await super().get_response(path, scope)
        kept = self._kept.get(path) or await to_thread.run_sync(self._read, path)
        if kept is None:
            return await super().get_response(path, scope)
        self._kept[path] = kept
        if self.is_not_modified(kept.headers, request):
            return NotModifiedResponse(kept.headers)
        return Response(kept.body, headers=kept.headers)

    def _read(self, path: str) -> Response | None:
        """Response with a whole file; None where the path is no file."""
        try:
            file, status = self.lookup_path(path)
            if status is None or not S_ISREG(status.st_mode):
                return None
            headers = FileResponse(file, stat_result=status).headers
            return Response(Path(file).read_bytes(), headers=headers)
        except (OSError, ValueError):
            return None
