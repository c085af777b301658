"""The sign-in link for another device: as text and as a QR code, for operators alone.

It is a password: whoever has it comes in as operator until the next start.  The page
asks for it only when somebody presses, and no cache keeps it.
"""

from ipaddress import ip_address

import segno
from fastapi import APIRouter, Depends, Request, Response

from iveg.models.signing_in import SignInCode
from iveg.web.api.answers import Json
from iveg.web.security.requirements import require

_SCALE = 6
"""Pixels of a module: read from an arm's length."""


def router(token: str) -> APIRouter:
    """One route; ``token`` is the link's."""
    routes = APIRouter(prefix="/api/v1", tags=["sign-in"])

    @routes.get(
        "/sign-in-code",
        response_model=SignInCode,
        dependencies=[Depends(require("release"))],
    )
    async def code(request: Request) -> Response:
        """The link at the address by which this browser has reached iVeg."""
        return Json(code_of(request, f"token={token}"))

    return routes


def code_of(request: Request, proof: str) -> SignInCode:
    """A link to sign in by, at the address by which this browser has reached iVeg."""
    link = f"{str(request.base_url).rstrip('/')}/signin#{proof}"
    image = segno.make(link, micro=False).svg_data_uri(
        scale=_SCALE, border=4, dark="#000", light="#fff"
    )
    return SignInCode(
        link=link, image=image, local=is_local(request.url.hostname or "")
    )


def is_local(host: str) -> bool:
    """Whether an address leads nowhere from another device."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost" or host.endswith(".localhost")
