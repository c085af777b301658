"""Cross-site request forgery: requests of other sites' pages with our cookie."""

from urllib.parse import urlsplit

from starlette.requests import HTTPConnection, Request

from iveg.web.problems import ForeignOriginError, NotJsonError


def refuse_forgery(request: Request) -> None:
    """Refuse a request without the two signs of our own page.

    Cookies come with anybody's request.  Browsers send Sec-Fetch-Site to trustworthy
    addresses only, so over plain HTTP in a greenhouse Origin has to do.

    Raises:
        ForeignOriginError: one of them is missing or another site's.
    """
    if request.headers.get("x-iveg") != "1":
        raise ForeignOriginError("header X-IVEG: 1")
    site = request.headers.get("sec-fetch-site")
    if site is None:
        own = is_own(request.headers.get("origin"), request)
    else:
        own = site in ("same-origin", "none")
    if not own:
        raise ForeignOriginError("same origin")


def refuse_other_bodies(request: Request) -> None:
    """Refuse bodies that are not JSON: forms of other sites can send anything else.

    Raises:
        NotJsonError: a body that is not declared as JSON.
    """
    content_type = request.headers.get("content-type")
    if content_type is None:
        has_body = request.headers.get("content-length", "0") != "0"
        if has_body or "transfer-encoding" in request.headers:
            raise NotJsonError
    elif content_type.partition(";")[0].strip().lower() != "application/json":
        raise NotJsonError


def is_own(origin: str | None, connection: HTTPConnection) -> bool:
    """Whether a page of this very server sent it.

    Only host and port are compared: behind a proxy the scheme differs.
    """
    host = connection.headers.get("host", "")
    try:
        place = urlsplit(origin or "").netloc
    except ValueError:
        return False  # such as brackets that do not close
    return bool(host) and place.lower() == host.lower()
