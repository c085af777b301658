"""The way to the identity provider and back, as a person's browser goes it."""

from typing import Annotated, Final

from fastapi import APIRouter, Depends, Query, Request, Response

from iveg.domain.errors import SignOnError
from iveg.web.pages.contexts import EnteredPage
from iveg.web.pages.drawing import Pages
from iveg.web.security.requirements import authenticator_of, require
from iveg.web.security.single_sign_on import CALLBACK, SingleSignOn

_STATUS: Final = {"unreachable": 503, "busy": 429, "outdated": 400}


def router(pages: Pages, sign_on: SingleSignOn) -> APIRouter:
    """The routes of single sign-on; open, as nobody is signed in there yet."""
    routes = APIRouter(include_in_schema=False, dependencies=[Depends(require("open"))])

    @routes.get("/signin/sso", response_model=None)
    async def begin(
        request: Request,
        to: Annotated[str, Query(max_length=512)] = "/",
        anew: bool = False,
    ) -> Response:
        try:
            return await sign_on.begin(request, to, anew=anew)
        except SignOnError as error:
            return _refused(pages, request, error)

    @routes.get(CALLBACK, response_model=None)
    async def finish(request: Request) -> Response:
        try:
            token, to = await sign_on.finish(request)
        except SignOnError as error:
            return _refused(pages, request, error)
        page = EnteredPage(pages.frame(request, "entered"), to)
        response = pages.draw(page)
        # A redirect would still be the provider's, and leave the Strict cookie behind.
        response.headers["Refresh"] = f"0; url={to}"
        return authenticator_of(request).admit(request, token, response)

    return routes


def _refused(pages: Pages, request: Request, error: SignOnError) -> Response:
    status = _STATUS.get(error.failure, 403)
    return pages.sign_in(request, status, failure=error.failure)
