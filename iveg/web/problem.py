"""One RFC 9457 problem, and the page that shows it to a person."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from iveg.ngsi.texts import all_legible


@dataclass(frozen=True, slots=True)
class Problem:
    """One RFC 9457 problem.

    Attributes:
        code: Stable, for programs; the last part of ``type``.
        extra: Further members, such as ``why`` of a refused release.
        headers: What the status asks for, such as ``Allow`` with 405.
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
            # A name that somebody asked for may be told back, but turns nothing round.
            all_legible(members),
            self.status,
            headers={"Cache-Control": "no-store", **self.headers},
            media_type="application/problem+json",
        )


Page = Callable[[Request, Problem], Response]
