"""Entities as Orion takes, stores and prints them, and what it refuses.

A value is printed as JSON text at its first use: most values of a fleet's telemetry are
replaced before anything uses them, the others are sent many times.
"""

import re
import secrets
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any, NamedTuple

import orjson
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from iveg.domain.errors import IvegError

Endpoint = Callable[[Request], Awaitable[Response]]

ENTITY_NOT_FOUND = "The requested entity has not been found. Check type and id"
_STATUS = {
    # Orion
    "BadRequest": 400,
    "ParseError": 400,
    "NotFound": 404,
    "TooManyResults": 409,
    "RequestEntityTooLarge": 413,
    "Unprocessable": 422,
    "PartialUpdate": 422,
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

    def body(self, name: str, sentence: str) -> bytes:
        """The JSON body of the response, with the keys of the service that answers."""
        return orjson.dumps({name: self.name, sentence: self.sentence})


def bad_request(sentence: str) -> FiwareError:
    """400, with Orion's sentence."""
    return FiwareError("BadRequest", sentence)


def parse_error() -> FiwareError:
    """400 for a body that is not JSON, or not an object."""
    return FiwareError("ParseError", "Errors found in incoming JSON buffer")


def not_found(sentence: str = ENTITY_NOT_FOUND) -> FiwareError:
    """404 of Orion, by default for an entity."""
    return FiwareError("NotFound", sentence)


def not_supported(what: str) -> FiwareError:
    """501 for what the embedded FIWARE leaves out."""
    return FiwareError(
        "NotImplemented", f"{what} is not supported by the embedded FIWARE"
    )


def wrong_syntax() -> FiwareError:
    """400 of the agent for a body of another shape."""
    return FiwareError(
        "WRONG_SYNTAX", "Wrong syntax in request: Errors found validating request."
    )


def no_device(name: str) -> FiwareError:
    """404 of the agent for a device, or for an entity without one."""
    return FiwareError("DEVICE_NOT_FOUND", f"No device was found with id:{name}")


def fiware_app(
    table: Mapping[str, Endpoint], refusal: Callable[[FiwareError], Response]
) -> Starlette:
    """The HTTP side of one service; all that its table lacks is answered by 501.

    Args:
        table: Endpoints by method and path, such as ``GET /v2/entities/{id}``.
        refusal: The service's response to an error.
    """

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


FORBIDDEN = frozenset("<>\"'=;()")
_NAME_FORBIDDEN = re.compile(r"[<>\"'=;()\s?/#&]")
_MAX_DEPTH = 128


def new_id() -> str:
    """24 hexadecimal digits, as MongoDB names its documents."""
    return secrets.token_hex(12)


# --- JSON -----------------------------------------------------------------------


def load_json(body: bytes) -> object:
    """Parse JSON from an untrusted client.

    Raises:
        FiwareError: 400, not JSON, or nested too deeply.
    """
    try:
        value = orjson.loads(body)
    except orjson.JSONDecodeError:
        raise parse_error() from None
    # Counting brackets is fast and mostly enough; a path of points has many, flat ones.
    if body.count(b"[") + body.count(b"{") > _MAX_DEPTH and _too_deep(value):
        raise parse_error()
    return value


def _too_deep(value: Any) -> bool:
    level = [value]
    for _ in range(_MAX_DEPTH):
        parts = [one.values() if isinstance(one, dict) else one for one in level]
        level = [one for part in parts for one in part if type(one) in (dict, list)]
        if not level:
            return False
    return True


def load_object(body: bytes) -> dict[str, object]:
    """Parse a JSON object.

    Raises:
        FiwareError: 400.
    """
    value = load_json(body)
    if not isinstance(value, dict):
        raise parse_error()
    return value


# --- forbidden characters -------------------------------------------------------


def looks_clean(body: bytes) -> bool:
    """Whether no string in a JSON text can contain a forbidden character.

    A quotation mark inside a string needs a backslash, so the backslash stands for it.
    Eight searches at memory speed instead of a walk over every value.
    """
    return not (
        b"<" in body
        or b">" in body
        or b"'" in body
        or b"=" in body
        or b";" in body
        or b"(" in body
        or b")" in body
        or b"\\" in body
    )


def holds_forbidden(value: object) -> bool:
    """Whether a string contains one of ``< > " ' = ; ( )``; Orion takes any key."""
    if isinstance(value, str):
        return not FORBIDDEN.isdisjoint(value)
    if isinstance(value, dict):
        return any(map(holds_forbidden, value.values()))
    if isinstance(value, list):
        return any(
            holds_forbidden(part) for part in value if type(part) in (str, dict, list)
        )
    return False


def check_value(value: object, *, clean: bool) -> None:
    """Refuse a value with a forbidden character in a string.

    Args:
        value: Of an attribute.
        clean: Whether the body is known to hold no forbidden character.

    Raises:
        FiwareError: 400, with Orion's sentence.
    """
    if not clean and holds_forbidden(value):
        raise bad_request("Invalid characters in attribute value")


def check_name(name: object, what: str) -> str:
    """A name that a client gave, if it is one that Orion takes.

    Raises:
        FiwareError: 400, with Orion's sentence.
    """
    if not isinstance(name, str):
        raise bad_request(f"invalid JSON type for {what}")
    _check_text(name, what)
    return name


@lru_cache(maxsize=4096)
def _check_text(name: str, what: str) -> None:
    if len(name) > 256:
        raise bad_request(f"{what} length: {len(name)}, max length supported: 256")
    if not name:
        raise bad_request(f"{what} length: 0, min length supported: 1")
    if _NAME_FORBIDDEN.search(name) is not None:
        raise bad_request(f"Invalid characters in {what}")


@lru_cache(maxsize=4096)
def quoted(text: str) -> bytes:
    """A short text as JSON, cached, since names and types recur."""
    return orjson.dumps(text)


# --- dates ----------------------------------------------------------------------


def date_text(value: object) -> bytes:
    """A date of a client as Orion prints it: UTC with milliseconds.

    Raises:
        FiwareError: 400, not a date.
    """
    try:
        moment = datetime.fromisoformat(str(value))
    except ValueError:
        raise bad_request("date has invalid format in attribute value") from None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return date_json(moment.timestamp())


def date_json(at: float) -> bytes:
    """Unix seconds as JSON text with milliseconds."""
    return b'"%b"' % date_iso(at).encode()


def date_iso(at: float) -> str:
    """Unix seconds as ISO-8601 with milliseconds and Z."""
    second, milliseconds = divmod(round(at * 1000), 1000)
    return f"{_whole_second(second)}.{milliseconds:03d}Z"


@lru_cache(maxsize=64)
def _whole_second(at: int) -> str:
    return datetime.fromtimestamp(at, UTC).isoformat()[:19]


class Value:
    """Value of an attribute, printed once at its first use.

    Args:
        given: The value as parsed JSON.
        json: The printed value, where it is known.
    """

    __slots__ = ("_given", "_json")

    def __init__(self, given: object = None, json: bytes = b"") -> None:
        self._given = given
        self._json = json

    @property
    def json(self) -> bytes:
        """The value as JSON text."""
        if not self._json:
            self._json, self._given = orjson.dumps(self._given), None
        return self._json


class Attribute(NamedTuple):
    """One attribute of an entity.

    Attributes:
        type: NGSI type.
        value: The value.
        instant: Its metadata ``TimeInstant`` as JSON text; empty for none.
        modified: Last change (s, Unix time).
    """

    type: str
    value: Value
    instant: bytes
    modified: float

    def normalized(self, *, dated: bool) -> bytes:
        """``{"type", "value", "metadata"}``; the date of change alone if ``dated``."""
        metadata = b""
        if dated:
            metadata = _metadata(b"dateModified", date_json(self.modified))
        elif self.instant:
            metadata = _metadata(b"TimeInstant", self.instant)
        return b'{"type":%b,"value":%b,"metadata":{%b}}' % (
            quoted(self.type),
            self.value.json,
            metadata,
        )


def _metadata(name: bytes, date: bytes) -> bytes:
    return b'"%b":{"type":"DateTime","value":%b}' % (name, date)


class EntityChange(NamedTuple):
    """Requested change of one attribute; ``None`` leaves the present type or instant.

    Attributes:
        value: Parsed JSON, or a printed ``Value``.
    """

    type: str | None
    value: object
    instant: bytes | None = None


@dataclass(slots=True)
class Entity:
    """One entity; its attributes are replaced, never altered.

    Attributes:
        path: Service path.
        created: Creation time (s, Unix time).
        modified: Last change (s, Unix time).
    """

    id: str
    type: str
    path: str
    created: float
    modified: float
    attributes: dict[str, Attribute] = field(default_factory=dict)

    @property
    def key(self) -> tuple[str, str, str]:
        """Unique key within a tenant."""
        return self.path, self.id, self.type


@dataclass(frozen=True, slots=True)
class Touched:
    """Effect of a change, for the evaluation of subscriptions.

    Attributes:
        now: New state of the attributes that the request named.
        before: Earlier state of these attributes.
    """

    now: Mapping[str, Attribute]
    before: Mapping[str, Attribute]

    def has_changed(self, name: str) -> bool:
        """Whether value, metadata or type of an attribute differ from before."""
        new, old = self.now.get(name), self.before.get(name)
        if new is None or old is None:
            return new is not None
        # Values last: they must be printed to be compared.
        return (
            old.instant != new.instant
            or old.type != new.type
            or old.value.json != new.value.json
        )


@dataclass(frozen=True, slots=True)
class Scope:
    """Tenant and service path of a request, and its time.

    Attributes:
        service: Tenant, lower case; empty for the default one.
        path: Service path.
        now: Seconds, Unix time.
    """

    service: str
    path: str
    now: float


def apply(entity: Entity, changes: Mapping[str, EntityChange], now: float) -> Touched:
    """Apply changes in place; missing attributes are created."""
    before, after = {}, {}
    for name, change in changes.items():
        old = entity.attributes.get(name)
        if old is not None:
            before[name] = old
        after[name] = _changed(old, change, now)
    entity.attributes.update(after)
    entity.modified = now
    return Touched(after, before)


def _changed(old: Attribute | None, change: EntityChange, now: float) -> Attribute:
    kind = change.type or (old.type if old else _default_type(change.value))
    value = change.value if isinstance(change.value, Value) else Value(change.value)
    instant = change.instant
    if instant is None:
        instant = old.instant if old else b""
    return Attribute(kind, value, instant, now)


def _default_type(value: object) -> str:
    """Type that Orion assigns to a value without type."""
    if isinstance(value, bool):
        return "Boolean"
    if isinstance(value, int | float):
        return "Number"
    if value is None:
        return "None"
    return "Text" if isinstance(value, str) else "StructuredValue"


# --- as JSON text ---------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class EntityView:
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
    key = b'"id":%b,"type":%b' % (quoted(entity.id), quoted(entity.type))
    shown = [
        quoted(name)
        + b":"
        + (one.value.json if view.bare else one.normalized(dated=view.dated))
        for name, one in _chosen(entity, view.names)
    ]
    return b"{%b}" % b",".join((key, *shown))


def _chosen(entity: Entity, names: tuple[str, ...]) -> Iterable[tuple[str, Attribute]]:
    for name in names or sorted(entity.attributes):
        if found := entity.attributes.get(name):
            yield name, found
        elif name in ("dateCreated", "dateModified"):
            at = entity.created if name == "dateCreated" else entity.modified
            yield name, Attribute("DateTime", Value(json=date_json(at)), b"", at)
