"""Errors become HTTP here, in the only file that knows both (RFC 9457).

The answer is ``application/problem+json``, or a page where a person's browser asked for
a page.  It echoes no input and reveals nothing internal.  HTTP adds to the tree of
``domain/errors``::

    IvegError
    ├── NotSignedInError    401
    ├── ForeignOriginError  403
    └── NotJsonError        415
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from iveg.domain.errors import (
    BusyError,
    CommandRefusedError,
    HopError,
    IvegError,
    MarkRefusedError,
    MissingExtraError,
    NameTakenError,
    NotAllowedError,
    NotANameError,
    NotRecordedError,
    OutdatedError,
    ProvidedAccountError,
    TrialRefusedError,
    UnknownNameError,
    UnknownRobotError,
    UnreadableError,
    VersionMissingError,
)
from iveg.domain.wire import all_legible
from iveg.models.base import stamp


class NotSignedInError(IvegError):
    """The request is not authenticated."""

    def __init__(self) -> None:
        super().__init__("Sign in with the link that iVeg printed, or send a token.")


class ForeignOriginError(IvegError):
    """A browser sent this from another site, or without iVeg's own header."""

    def __init__(self, missing: str) -> None:
        super().__init__(f"This did not come from iVeg's own page: {missing}.")


class NotJsonError(IvegError):
    """A body that is not declared as JSON."""

    def __init__(self) -> None:
        super().__init__("Send the body as application/json.")


@dataclass(frozen=True, slots=True)
class Problem:
    """One RFC 9457 problem.

    Attributes:
        code: Stable, for programs; the last part of ``type``.
        extra: Further members, such as ``why`` of a refused release.
        headers: Headers of the status, such as ``Allow`` with 405.
    """

    status: int
    detail: str
    code: str = ""
    extra: Mapping[str, object] = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)

    def response(self) -> Response:
        """The problem as a program reads it."""
        members = {
            "type": f"urn:iveg:{self.code}" if self.code else "about:blank",
            "title": HTTPStatus(self.status).phrase,
            "status": self.status,
            "detail": self.detail,
            **self.extra,
        }
        return JSONResponse(
            # A name of the request is repeated without marks that turn text round.
            all_legible(members),
            self.status,
            headers={"Cache-Control": "no-store", **self.headers},
            media_type="application/problem+json",
        )


Page = Callable[[Request, Problem], Response]


_MOST_COMPLAINTS = 20


def install(app: FastAPI, page: Page | None = None) -> None:
    """Turn every error of ``app`` into a problem.

    Args:
        app: The finished application.
        page: Draws a problem for a person who navigated there; None answers JSON.
    """

    async def answer(request: Request, error: Exception) -> Response:
        problem = problem_of(error)
        if page is not None and _wants_a_page(request):
            return page(request, problem)
        return problem.response()

    for kind in (IvegError, RequestValidationError, HTTPException, Exception):
        app.add_exception_handler(kind, answer)


def problem_of(error: Exception) -> Problem:
    """The problem that callers see for an error."""
    match error:
        case RequestValidationError():
            return _invalid(error)
        case HTTPException():
            return Problem(
                error.status_code, str(error.detail), headers=error.headers or {}
            )
        case UnreadableError():
            return Problem(400, str(error), "unreadable", {"reason": error.reason})
        case NotRecordedError():
            ends = {"before": stamp(error.before), "after": stamp(error.after)}
            return Problem(404, str(error), "not-recorded", ends)
        case HopError():
            # Addresses and messages of drivers stay inside.
            detail = f"{error.hop} did not answer."
            return Problem(503, detail, "hop", {"hop": error.hop})
    for kind, status, code in _PLAIN:
        if isinstance(error, kind):
            extra = {"why": error.why} if isinstance(error, _REFUSALS) else {}
            return Problem(status, str(error), code, extra, _HEADERS.get(kind, {}))
    # The server logs the traceback: Starlette raises it again after this answer.
    return Problem(500, "Something failed inside iVeg; its log says what.")


_REFUSALS = CommandRefusedError, MarkRefusedError, TrialRefusedError
_PLAIN: tuple[tuple[type[IvegError], int, str], ...] = (
    (NotSignedInError, 401, "not-signed-in"),
    (BusyError, 429, "busy"),
    (UnknownRobotError, 404, "unknown-robot"),
    (UnknownNameError, 404, "unknown-name"),
    (NotAllowedError, 403, "not-allowed"),
    (CommandRefusedError, 409, "command-refused"),
    (MarkRefusedError, 409, "mark-refused"),
    (TrialRefusedError, 409, "trial-refused"),
    (NameTakenError, 409, "name-taken"),
    (NotANameError, 422, "not-a-name"),
    (OutdatedError, 409, "outdated"),
    (ProvidedAccountError, 409, "provided-account"),
    (VersionMissingError, 428, "version-missing"),
    (MissingExtraError, 501, "missing-extra"),
    (ForeignOriginError, 403, "foreign-origin"),
    (NotJsonError, 415, "not-json"),
)

_HEADERS: Mapping[type[IvegError], Mapping[str, str]] = {
    NotSignedInError: {"WWW-Authenticate": "Bearer"},
    BusyError: {"Retry-After": "2"},
}


def _invalid(error: RequestValidationError) -> Problem:
    complaints = error.errors()
    if any(complaint["type"] == "json_invalid" for complaint in complaints):
        return Problem(400, "The body is not JSON.", "unreadable")
    # Only place and reason: the input itself may hold NaN, secrets or megabytes.
    errors = [
        {
            "where": ".".join(str(part) for part in complaint["loc"])[:200],
            # A validator of our own writes its sentence itself and may quote the value.
            "what": "not allowed"
            if complaint["type"] == "value_error"
            else str(complaint["msg"])[:200],
        }
        for complaint in complaints[:_MOST_COMPLAINTS]
    ]
    detail = f"{len(complaints)} value(s) cannot be used."
    return Problem(422, detail, "invalid", {"errors": errors})


def _wants_a_page(request: Request) -> bool:
    # The API answers JSON to a browser, too.
    accepts_html = "text/html" in request.headers.get("accept", "")
    return accepts_html and not request.url.path.startswith("/api/")
