"""Common parts of NGSI-v2 requests: headers, options, paging, body."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from iveg.lab.embedded.entities import EntityChange, read_changes
from iveg.lab.embedded.http_server import Request
from iveg.lab.embedded.orion_text import (
    NgsiError,
    bad_request,
    check_name,
    load_json,
    looks_clean,
    parse_error,
)
from iveg.lab.embedded.scope import Scope
from iveg.lab.embedded.views import EntityView

MAX_BODY = 1 << 20
_SERVICE = re.compile(r"[a-z0-9_]{0,50}")
_PATH = re.compile(r"/|(/[A-Za-z0-9_]{1,50}){1,10}(/#)?|/#")
_OPTIONS = {
    "keyValues", "values", "unique", "count", "append", "upsert", "skipForwarding",
    "forcedUpdate", "overrideMetadata", "normalized", "skipInitialNotification",
    "flowControl", "noAttrDetail",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Call:
    """One parsed request.

    Attributes:
        options: ``?options=``.
        parts: The path's parts after ``/v2``.
    """

    request: Request
    scope: Scope
    options: frozenset[str]
    parts: tuple[str, ...]

    @property
    def key_values(self) -> bool:
        """Whether the body's attributes are plain values."""
        return "keyValues" in self.options

    @property
    def kind(self) -> str:
        """``?type=``."""
        return self.request.query.get("type", "")

    def json(self) -> Any:
        """The body.

        Raises:
            NgsiError: 400, not JSON.
        """
        return load_json(self.request.body)

    def object(self) -> dict[str, Any]:
        """The body, which must be an object.

        Raises:
            NgsiError: 400.
        """
        value = self.json()
        if not isinstance(value, dict):
            raise parse_error()
        return value

    def changes(self, raw: Mapping[str, Any]) -> dict[str, EntityChange]:
        """Read attributes of the body.

        Raises:
            NgsiError: 400.
        """
        return read_changes(
            {name: one for name, one in raw.items() if name not in ("id", "type")},
            key_values=self.key_values,
            clean=looks_clean(self.request.body),
        )

    def view(self) -> EntityView:
        """The requested representation.

        Raises:
            NgsiError: 400.
        """
        forms = self.options & {"keyValues", "values", "unique"}
        form = next(iter(forms), "normalized")
        query = self.request.query
        return EntityView(form, names(query.get("attrs")), names(query.get("metadata")))


def check_size(request: Request) -> None:
    """Refuse a body that is too large.

    Raises:
        NgsiError: 413.
    """
    if len(request.body) > MAX_BODY:
        raise NgsiError(
            413,
            "RequestEntityTooLarge",
            f"payload size: {len(request.body)}, max size supported: {MAX_BODY}",
        )


def check_body(request: Request) -> None:
    """Refuse a body that is missing or of another type.

    Raises:
        NgsiError: 411 or 415.
    """
    if request.method not in ("POST", "PUT", "PATCH"):
        return
    if not request.body:
        raise NgsiError(
            411,
            "ContentLengthRequired",
            "Zero/No Content-Length in PUT/POST/PATCH request",
        )
    kind = request.headers.get("content-type", "").partition(";")[0].strip()
    plain = request.path.endswith("/value")
    if kind == "application/json" or (plain and kind == "text/plain"):
        return
    sentence = (
        f"not supported content type: {kind}"
        if kind
        else "Content-Type header not used, default application/octet-stream is not "
        "supported"
    )
    raise NgsiError(415, "UnsupportedMediaType", sentence)


def check_accept(request: Request) -> None:
    """Refuse a client that does not accept JSON.

    Raises:
        NgsiError: 406.
    """
    accepted = {
        one.partition(";")[0].strip()
        for one in request.headers.get("accept", "*/*").split(",")
    }
    usable = {"*/*", "application/json", "application/*"}
    if request.path.endswith("/value"):
        usable |= {"text/plain", "text/*"}
    if not accepted & usable:
        raise NgsiError(
            406, "NotAcceptable", "no acceptable mime-type in accept header"
        )


def scope(request: Request, correlator: str, now: float) -> Scope:
    """Tenant and service path of a request.

    Raises:
        NgsiError: 400, invalid tenant or service path.
    """
    service = request.headers.get("fiware-service", "").lower()
    if _SERVICE.fullmatch(service) is None:
        raise bad_request(
            "bad character in tenant name - only underscore and alphanumeric "
            "characters are allowed"
        )
    reads = request.method == "GET"
    path = request.headers.get("fiware-servicepath", "/#" if reads else "/")
    for one in path.split(","):
        if not one.startswith("/"):
            raise bad_request(
                "Only /absolute/ Service Paths allowed "
                "[a service path must begin with /]"
            )
        if _PATH.fullmatch(one) is None or (one.endswith("#") and not reads):
            raise bad_request("Bad Character in Service-Path")
    return Scope(service, path, correlator, now)


def paging(query: Mapping[str, str]) -> tuple[int, int]:
    """``?limit=`` and ``?offset=``.

    Raises:
        NgsiError: 400.
    """
    limit, offset = query.get("limit", "20"), query.get("offset", "0")
    for name, text in (("limit", limit), ("offset", offset)):
        if text.startswith("-"):
            raise bad_request(
                f"Bad pagination {name}: /{text}/ [must be a positive integer number]"
            )
        if not (text.isascii() and text.isdigit()):
            raise bad_request(
                f"Bad pagination {name}: /{text}/ [must be a decimal number]"
            )
    if int(limit) > 1000:
        raise bad_request(f"Bad pagination limit: /{limit}/ [max: 1000]")
    return int(limit), int(offset)


def read_options(request: Request) -> frozenset[str]:
    """``?options=``.

    Raises:
        NgsiError: 400, unknown to Orion.
    """
    options = frozenset(names(request.query.get("options")))
    if not options <= _OPTIONS:
        raise bad_request("Invalid value for URI param /options/")
    return options


def names(text: str | None) -> tuple[str, ...]:
    """A comma-separated list."""
    return tuple(name for name in (text or "").split(",") if name)


def read_id(raw: Any) -> tuple[str, str]:
    """Id and type of an entity in a body.

    Raises:
        NgsiError: 400.
    """
    if not isinstance(raw, dict):
        raise parse_error()
    entity_id, kind = raw.get("id", ""), raw.get("type", "Thing")
    for text, what in ((entity_id, "entity id"), (kind, "entity type")):
        if not isinstance(text, str):
            raise bad_request(f"Invalid JSON type for {what}")
        check_name(text, what)
    return entity_id, kind


def read_value(call: Call) -> Any:
    """The body of ``PUT …/value``.

    Raises:
        NgsiError: 400.
    """
    kind = call.request.headers.get("content-type", "")
    try:
        value = load_json(call.request.body)
    except NgsiError:
        if kind.startswith("application/json"):
            raise parse_error() from None
        raise bad_request("attribute value type not recognized") from None
    if kind.startswith("application/json") and not isinstance(value, dict | list):
        raise bad_request("Neither JSON Object nor JSON Array for attribute::value")
    return value
