"""The service worker at the root, where its scope is every page."""

from importlib.resources import files

from fastapi import APIRouter, Depends
from fastapi.responses import FileResponse

from iveg.web.security.requirements import require


def router() -> APIRouter:
    """One file, without anything that strangers may not see."""
    routes = APIRouter(include_in_schema=False)

    @routes.get("/sw.js", dependencies=[Depends(require("open"))])
    async def worker() -> FileResponse:
        """Never from a cache: a change must reach every device."""
        file = str(files("iveg") / "static" / "sw.js")
        headers = {"Cache-Control": "no-cache"}
        return FileResponse(file, headers=headers, media_type="text/javascript")

    return routes
