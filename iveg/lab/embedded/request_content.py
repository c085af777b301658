"""Kinds of content that a request may bring and ask for."""

from iveg.lab.embedded.errors import FiwareError
from iveg.lab.embedded.http_server import Request

_MAX_BODY = 1 << 20


def check_content(request: Request) -> None:
    """Refuse a body that is too large, missing or of another type.

    Raises:
        FiwareError: 411, 413 or 415.
    """
    size = len(request.body)
    if size > _MAX_BODY:
        raise FiwareError(
            "RequestEntityTooLarge",
            f"payload size: {size}, max size supported: {_MAX_BODY}",
        )
    if request.method not in ("POST", "PUT", "PATCH"):
        return
    if not size:
        raise FiwareError(
            "ContentLengthRequired", "Zero/No Content-Length in PUT/POST/PATCH request"
        )
    kind = request.headers.get("content-type", "").partition(";")[0].strip()
    if kind != _JSON:
        raise FiwareError(
            "UnsupportedMediaType",
            f"not supported content type: {kind}" if kind else _NO_CONTENT_TYPE,
        )


_JSON = "application/json"


_NO_CONTENT_TYPE = (
    "Content-Type header not used, default application/octet-stream is not supported"
)


def check_accept(request: Request) -> None:
    """Refuse a client that does not accept what it would get.

    Raises:
        FiwareError: 406.
    """
    accepted = request.headers.get("accept", "*/*").split(",")
    kinds = {one.partition(";")[0].strip() for one in accepted}
    usable = {"*/*", "application/*", _JSON}
    if kinds.isdisjoint(usable):
        raise FiwareError("NotAcceptable", "no acceptable mime-type in accept header")
