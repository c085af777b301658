"""Entities as Orion stores them, and their changes.

A value is printed as JSON text at its first use: most values of a fleet's telemetry are
replaced before anything uses them, the others are sent many times.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import orjson

from iveg.lab.embedded.errors import not_supported
from iveg.lab.embedded.orion_dates import date_json, date_text
from iveg.lab.embedded.orion_numbers import print_value
from iveg.lab.embedded.orion_text import quoted

BUILTIN_DATES = ("dateCreated", "dateModified")


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
        """JSON text that Orion would print."""
        if not self._json:
            self._json, self._given = print_value(self._given), None
        return self._json


class Attribute(NamedTuple):
    """One attribute of an entity.

    Attributes:
        type: NGSI type.
        value: The value.
        metadata: Name → ``{"type": …, "value": …}`` as Orion prints it.
        created: Creation time (s, Unix time).
        modified: Last change of value or metadata (s, Unix time).
    """

    type: str
    value: Value
    metadata: Mapping[str, bytes]
    created: float
    modified: float

    @property
    def json(self) -> bytes:
        """JSON text of the value."""
        return self.value.json

    def normalized(self, wanted: Iterable[str] = ()) -> bytes:
        """``{"type", "value", "metadata"}``, with the wanted metadata first."""
        metadata = self._metadata(wanted) if wanted else self.metadata
        inner = b",".join(quoted(name) + b":" + text for name, text in metadata.items())
        return b'{"type":%b,"value":%b,"metadata":{%b}}' % (
            quoted(self.type),
            self.json,
            inner,
        )

    def _metadata(self, wanted: Iterable[str]) -> dict[str, bytes]:
        chosen: dict[str, bytes] = {}
        for name in wanted:
            if name == "*":
                chosen.update(self.metadata)
            elif name in BUILTIN_DATES:
                at = self.created if name == "dateCreated" else self.modified
                chosen[name] = b'{"type":"DateTime","value":%b}' % date_json(at)
            elif name in self.metadata:
                chosen[name] = self.metadata[name]
        return chosen


class EntityChange(NamedTuple):
    """Requested change of one attribute; ``None`` leaves the present value.

    Attributes:
        value: Parsed JSON, or a printed ``Value``.
    """

    type: str | None
    value: object
    metadata: Mapping[str, bytes] | None = None


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
        now: New state of the attributes that the request named, in its order.
        before: Earlier state of these attributes.
        all: Whether each of them counts as changed.
    """

    now: Mapping[str, Attribute]
    before: Mapping[str, Attribute] = field(default_factory=dict)
    all: bool = False

    def has_changed(self, name: str, *, metadata_too: bool = True) -> bool:
        """Whether value, or metadata or type, of an attribute differ from before."""
        new, old = self.now.get(name), self.before.get(name)
        if new is None or old is None or self.all:
            return new is not None
        # Metadata first: values must be printed to be compared.
        return (
            metadata_too and (old.metadata != new.metadata or old.type != new.type)
        ) or old.json != new.json


@dataclass(frozen=True, slots=True)
class Scope:
    """Tenant and service path of a request, and its time.

    Attributes:
        service: Tenant, lower case; empty for the default one.
        path: Service path, or ``/#`` for reading all.
        correlator: Correlator of the chain of requests.
        now: Seconds, Unix time.
    """

    service: str
    path: str
    correlator: str
    now: float


def under(paths: str, path: str) -> bool:
    """Whether a service path is the requested one; ``/#`` requests all."""
    return paths in (path, "/#")


def apply(
    entity: Entity,
    changes: Mapping[str, EntityChange],
    now: float,
    *,
    forced: bool = False,
) -> Touched:
    """Apply changes; missing attributes are created.

    Args:
        entity: Changed in place.
        changes: By attribute name.
        now: Seconds, Unix time.
        forced: Count every named attribute as changed (``forcedUpdate``).
    """
    before, after = {}, {}
    for name, change in changes.items():
        old = entity.attributes.get(name)
        if old is not None:
            before[name] = old
        after[name] = _changed(old, change, now)
    entity.attributes.update(after)
    entity.modified = now
    return Touched(after, before, all=forced)


def _changed(old: Attribute | None, change: EntityChange, now: float) -> Attribute:
    kind = change.type or (old.type if old else default_type(change.value))
    value = change.value
    if isinstance(value, dict) and "$" in "".join(value):
        value = _operated(old, value)
    kept = value if isinstance(value, Value) else _value(kind, value)
    if old is None:
        return Attribute(kind, kept, change.metadata or {}, now, now)
    metadata = old.metadata
    if change.metadata is not None:
        metadata = _merged(metadata, change.metadata)
    return Attribute(kind, kept, metadata, old.created, now)


def _value(kind: str, value: object) -> Value:
    return Value(json=date_text(value)) if kind == "DateTime" else Value(value)


def _merged(old: Mapping[str, bytes], new: Mapping[str, bytes]) -> Mapping[str, bytes]:
    return new if old.keys() <= new.keys() else {**old, **new}


def _operated(attribute: Attribute | None, value: Mapping[str, object]) -> object:
    """The value after Orion's update operators; a key that begins with ``$`` is one."""
    name = next((key for key in value if key.startswith("$")), "")
    if not name:
        return value
    argument = value[name]
    if name == "$set":
        return argument
    if name != "$inc" or not isinstance(argument, int | float):
        raise not_supported(f"operator {name}")
    old = None if attribute is None else orjson.loads(attribute.json)
    return argument + (old if isinstance(old, int | float) else 0)


def default_type(value: object) -> str:
    """Type that Orion assigns to a value without type."""
    if isinstance(value, bool):
        return "Boolean"
    if isinstance(value, int | float):
        return "Number"
    if value is None:
        return "None"
    return "Text" if isinstance(value, str) else "StructuredValue"


def metadata_json(kind: str, value: object) -> bytes:
    """One metadata entry as Orion prints it."""
    text = date_text(value) if kind == "DateTime" else print_value(value)
    return b'{"type":%b,"value":%b}' % (quoted(kind), text)
