"""Errors become HTTP here: the only file that knows both.

The answer is ``application/problem+json`` (RFC 9457), or a page where a person's
browser asked for one.  Answers echo no input and reveal nothing internal.
"""

import math
from collections.abc import Mapping

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from iveg.domain.errors import (
    BusyError,
    CommandRefusedError,
    ExperimentRefusedError,
    HopError,
    IvegError,
    MarkRefusedError,
    MissingExtraError,
    NameTakenError,
    NotAllowedError,
    NotRecordedError,
    OutdatedError,
    ProvidedAccountError,
    TooManyLookError,
    TrialRefusedError,
    UnknownNameError,
    UnknownRobotError,
    UnreadableError,
    VersionMissingError,
    WhatIfRefusedError,
)
from iveg.models.base import stamp
from iveg.web.errors import (
    ForeignOriginError,
    NotJsonError,
    NotSignedInError,
    PasskeyAddressError,
    PinRefusedError,
    ProofNeededError,
)
from iveg.web.problem import Page, Problem

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
    """The problem that an error is to the outside."""
    match error:
        case RequestValidationError():
            return _invalid(error)
        case HTTPException():
            return Problem(
                error.status_code, str(error.detail), headers=error.headers or {}
            )
        case (
            CommandRefusedError()
            | ExperimentRefusedError()
            | MarkRefusedError()
            | TrialRefusedError()
            | WhatIfRefusedError()
        ):
            return Problem(409, str(error), _REFUSED[type(error)], {"why": error.why})
        case UnreadableError():
            return Problem(400, str(error), "unreadable", {"reason": error.reason})
        case PinRefusedError():
            return _refused_pin(error)
        case NotRecordedError():
            ends = {"before": stamp(error.before), "after": stamp(error.after)}
            return Problem(404, str(error), "not-recorded", ends)
        case HopError():
            return _broken_hop(error)
    for kind, status, code in _PLAIN:
        if isinstance(error, kind):
            headers = _HEADERS.get(kind, {})
            return Problem(status, str(error), code, headers=headers)
    # The server logs the traceback: Starlette raises it again after this answer.
    return Problem(500, "Something failed inside iVeg; its log says what.")


def _broken_hop(error: HopError) -> Problem:
    extra = {"hop": error.hop}
    if isinstance(error, TooManyLookError):
        said = "Too many look at the past at once."
        return Problem(503, said, "hop", {**extra, "why": "viewers"})
    # Addresses and drivers' words stay inside.
    return Problem(503, f"{error.hop} did not answer.", "hop", extra)


def _refused_pin(error: PinRefusedError) -> Problem:
    wait_s = math.ceil(error.wait_s)
    members = {"blocked_s": wait_s}
    if error.left is None:
        wait = {"Retry-After": str(wait_s)}
        return Problem(429, str(error), "pin-blocked", members, wait)
    return Problem(403, str(error), "pin-wrong", {**members, "left": error.left})


_REFUSED: Mapping[type[IvegError], str] = {
    CommandRefusedError: "command-refused",
    ExperimentRefusedError: "experiment-refused",
    MarkRefusedError: "mark-refused",
    TrialRefusedError: "trial-refused",
    WhatIfRefusedError: "what-if-refused",
}
_PLAIN: tuple[tuple[type[IvegError], int, str], ...] = (
    (NotSignedInError, 401, "not-signed-in"),
    (BusyError, 429, "busy"),
    (UnknownRobotError, 404, "unknown-robot"),
    (UnknownNameError, 404, "unknown-name"),
    (NotAllowedError, 403, "not-allowed"),
    (NameTakenError, 409, "name-taken"),
    (OutdatedError, 409, "outdated"),
    (ProvidedAccountError, 409, "provided-account"),
    (VersionMissingError, 428, "version-missing"),
    (ProofNeededError, 403, "proof-needed"),
    (PasskeyAddressError, 409, "passkey-address"),
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
    # Only where and what: the input itself may hold NaN, secrets or megabytes.
    errors = [
        {
            "where": ".".join(str(part) for part in complaint["loc"])[:200],
            "what": _what(str(complaint["type"]), str(complaint["msg"])),
        }
        for complaint in complaints[:_MOST_COMPLAINTS]
    ]
    detail = f"{len(complaints)} value(s) cannot be used."
    return Problem(422, detail, "invalid", {"errors": errors})


def _what(kind: str, message: str) -> str:
    # A validator of our own writes its sentence itself and may quote the value.
    return "not allowed" if kind == "value_error" else message[:200]


def _wants_a_page(request: Request) -> bool:
    accepts_html = "text/html" in request.headers.get("accept", "")
    return accepts_html and not request.url.path.startswith("/api/")
