"""Entities as Orion takes, stores and prints them, and requests that it refuses.

A value is printed as JSON text at its first use: most values of a fleet's telemetry are
replaced before anything uses them, the others are sent many times.
"""

import re
import secrets
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, NamedTuple

import orjson
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from iveg.domain.errors import IvegError

Endpoint = Callable[[Request], Awaitable[Response]]

_STATUS = {
    # Orion
    "BadRequest": 400,
    "ParseError": 400,
    "NotFound": 404,
    "RequestEntityTooLarge": 413,
    "Unprocessable": 422,
    "NotImplemented": 501,
    # IoT Agent
    "WRONG_SYNTAX": 400,
    "MISSING_ATTRIBUTES": 400,
    "MISSING_CONFIG_PARAMS": 400,
    "MISSING_HEADERS": 400,
    "DEVICE_NOT_FOUND": 404,
    "DEVICE_GROUP_NOT_FOUND": 404,
    "DUPLICATE_DEVICE_ID": 409,
    "DUPLICATE_GROUP": 409,
}


class FiwareError(IvegError):
    """A request that Orion or the IoT Agent would refuse.

    Attributes:
        status: HTTP status of the name.
        name: Error name, such as ``BadRequest`` or ``DUPLICATE_DEVICE_ID``.
        sentence: The description or message.
    """

    def __init__(self, name: str, sentence: str) -> None:
        self.status = _STATUS[name]
        self.name = name
        self.sentence = sentence
        super().__init__(f"{self.status} {name}: {sentence}")


def bad_request(sentence: str) -> FiwareError:
    """400, with Orion's sentence."""
    return FiwareError("BadRequest", sentence)


def not_found(
    sentence: str = "The requested entity has not been found. Check type and id",
) -> FiwareError:
    """404 of Orion, by default for an entity."""
    return FiwareError("NotFound", sentence)


def not_supported(what: str) -> FiwareError:
    """501, for a request that the embedded FIWARE does not support."""
    return FiwareError(
        "NotImplemented", f"{what} is not supported by the embedded FIWARE"
    )


def fiware_app(table: Mapping[str, Endpoint], name: str, sentence: str) -> Starlette:
    """The HTTP side of one service; requests outside its table get 501.

    Args:
        table: Endpoints by method and path, such as ``GET /v2/entities/{id}``.
        name: Key of the error's name in the service's responses.
        sentence: Key of the error's sentence.
    """

    def refusal(error: FiwareError) -> Response:
        body = orjson.dumps({name: error.name, sentence: error.sentence})
        return Response(body, error.status, media_type="application/json")

    async def refuse(_: Request, error: Exception) -> Response:
        assert isinstance(error, FiwareError)  # noqa: S101 - what it is registered for
        return refusal(error)

    async def answer_unknown(request: Request, _: Exception) -> Response:
        return refusal(not_supported(f"{request.method} {request.url.path}"))

    routes = []
    for line, endpoint in table.items():
        verb, path = line.split()
        routes.append(Route(path, endpoint, methods=[verb]))
    unknown = dict.fromkeys((404, 405), answer_unknown)
    return Starlette(routes=routes, exception_handlers={FiwareError: refuse, **unknown})


FORBIDDEN = "<>\"'=;()"
"""Characters that Orion takes in no value."""
_SUSPECT = rb"<>'=;()\\"
"""Bytes that may be a forbidden character; a quotation mark in a string shows by its
backslash."""
_MAX_DEPTH = 254
"""Deepest nesting that ``orjson`` prints."""
_NAME_FORBIDDEN = re.compile(rf"[{FORBIDDEN}\s?/#&]")


def new_id() -> str:
    """24 hexadecimal digits, as MongoDB names its documents."""
    return secrets.token_hex(12)


# --- JSON -----------------------------------------------------------------------


def load_object(body: bytes) -> dict[str, Any]:
    """Parse a JSON object from an untrusted client.

    Raises:
        FiwareError: 400, not JSON, no object, or nested too deeply to be printed.
    """
    try:
        value = orjson.loads(body)
        # Printing costs more than reading: only a text with so many brackets is tried.
        if body.count(b"[") + body.count(b"{") > _MAX_DEPTH:
            orjson.dumps(value)
    except (orjson.JSONDecodeError, orjson.JSONEncodeError):
        value = None
    if not isinstance(value, dict):
        raise FiwareError("ParseError", "Errors found in incoming JSON buffer")
    return value


# --- forbidden characters -------------------------------------------------------


def looks_clean(body: bytes) -> bool:
    """Whether no string in a JSON text can contain a forbidden character.

    One fast search instead of a walk over every value.
    """
    return len(body.translate(None, _SUSPECT)) == len(body)


def holds_forbidden(value: object) -> bool:
    """Whether a string contains one of ``< > " ' = ; ( )``; Orion takes any key."""
    if isinstance(value, str):
        return any(character in FORBIDDEN for character in value)
    if isinstance(value, dict):
        return any(map(holds_forbidden, value.values()))
    return isinstance(value, list) and any(map(holds_forbidden, value))


def check_value(value: object, *, clean: bool) -> None:
    """Refuse a value with a forbidden character in a string.

    Args:
        value: Value of an attribute.
        clean: Whether the body is known to hold no forbidden character.

    Raises:
        FiwareError: 400, with Orion's sentence.
    """
    if not clean and holds_forbidden(value):
        raise bad_request("Invalid characters in attribute value")


def check_name(name: object, what: str) -> str:
    """A client's name for something, if Orion takes it.

    Raises:
        FiwareError: 400, with Orion's sentence.
    """
    if not isinstance(name, str):
        raise bad_request(f"invalid JSON type for {what}")
    if len(name) > 256:
        raise bad_request(f"{what} length: {len(name)}, max length supported: 256")
    if not name:
        raise bad_request(f"{what} length: 0, min length supported: 1")
    if _NAME_FORBIDDEN.search(name) is not None:
        raise bad_request(f"Invalid characters in {what}")
    return name


# --- dates ----------------------------------------------------------------------


def read_date(value: object) -> str:
    """A date of a client as Orion prints it: UTC with milliseconds.

    Raises:
        FiwareError: 400, not a date.
    """
    try:
        moment = datetime.fromisoformat(str(value))
    except ValueError:
        raise bad_request("date has invalid format in attribute value") from None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return write_date(moment.timestamp())


def write_date(at: float) -> str:
    """Unix seconds as ISO-8601 with milliseconds and Z."""
    moment = datetime.fromtimestamp(round(at, 3), UTC)
    return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")


# --- entities -------------------------------------------------------------------


@dataclass(frozen=True)
class Attribute:
    """One attribute of an entity, as it is stored or as a change asks for it.

    Attributes:
        type: NGSI type.
        value: Parsed JSON.
        instant: Its metadata ``TimeInstant``; empty for none, in a change for the
            present instant.
        modified: Last change (s, Unix time).
    """

    type: str
    value: Any
    instant: str = ""
    modified: float = 0.0

    @cached_property
    def json(self) -> bytes:
        """The value as JSON text, printed once."""
        return orjson.dumps(self.value)

    def differs(self, other: "Attribute") -> bool:
        """Whether value, metadata or type differ."""
        # Values last, since their comparison prints them.
        return (
            self.instant != other.instant
            or self.type != other.type
            or self.json != other.json
        )

    def normalized(self, *, dated: bool) -> bytes:
        """``{"type", "value", "metadata"}``; the date of change alone if ``dated``."""
        name, date = "TimeInstant", self.instant
        if dated:
            name, date = "dateModified", write_date(self.modified)
        metadata = {name: {"type": "DateTime", "value": date}} if date else {}
        return b'{"type":%b,"value":%b,"metadata":%b}' % (
            orjson.dumps(self.type),
            self.json,
            orjson.dumps(metadata),
        )


@dataclass(slots=True)
class Entity:
    """One entity; its attributes are replaced, never altered.

    Attributes:
        path: Service path.
        modified: Last change (s, Unix time).
    """

    id: str
    type: str
    path: str
    modified: float = 0.0
    attributes: dict[str, Attribute] = field(default_factory=dict)

    @property
    def key(self) -> tuple[str, str, str]:
        """Unique key within a tenant."""
        return self.path, self.id, self.type

    def apply(self, changes: Mapping[str, Attribute], now: float) -> set[str]:
        """Apply changes; missing attributes are created.

        Returns:
            Names of the attributes that differ from before.
        """
        changed = set()
        for name, new in changes.items():
            old = self.attributes.get(name)
            instant = new.instant or (old.instant if old else "")
            kept = replace(new, instant=instant, modified=now)
            if old is None or kept.differs(old):
                changed.add(name)
            self.attributes[name] = kept
        self.modified = now
        return changed


class Scope(NamedTuple):
    """Tenant and service path of a request.

    Attributes:
        service: Tenant, lower case; empty for the default one.
        path: Service path; the agent calls it subservice.
    """

    service: str
    path: str


class EntityView(NamedTuple):
    """Requested representation.

    Attributes:
        names: Attributes in the requested order; empty for all, by name.
        bare: Values alone (``keyValues``) instead of ``normalized``.
        dated: ``dateModified`` as the only metadata.
    """

    names: tuple[str, ...] = ()
    bare: bool = False
    dated: bool = False


def write_entity(entity: Entity, view: EntityView) -> bytes:
    """JSON text of one entity."""
    members = [
        b'"id":%b,"type":%b' % (orjson.dumps(entity.id), orjson.dumps(entity.type))
    ]
    for name, attribute in _chosen(entity, view.names):
        printed = (
            attribute.json if view.bare else attribute.normalized(dated=view.dated)
        )
        members.append(orjson.dumps(name) + b":" + printed)
    return b"{%b}" % b",".join(members)


def _chosen(entity: Entity, names: tuple[str, ...]) -> Iterable[tuple[str, Attribute]]:
    for name in names or sorted(entity.attributes):
        if attribute := entity.attributes.get(name):
            yield name, attribute
        elif name == "dateModified":
            yield name, Attribute("DateTime", write_date(entity.modified))
