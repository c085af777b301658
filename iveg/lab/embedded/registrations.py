"""Registrations: attributes of other context providers, and requests to them.

A command is such an attribute.  An update of it goes to the provider as ``op/update``,
a read as ``op/query``; for a provider that is silent, slow or refuses, the client gets
an entity that does not exist.
"""

import asyncio
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal
from urllib.parse import urlsplit

import orjson
from pydantic import Field

from iveg.lab.embedded.documents import Document, new_id, read_document
from iveg.lab.embedded.entities import (
    Attribute,
    EntityChange,
    Scope,
    Value,
    default_type,
    metadata_json,
    under,
)
from iveg.lab.embedded.notifier import (
    AGENT,
    NotificationTarget,
    exchange,
    with_length,
    write_head,
)

PATIENCE_S = 5.0
Foreign = Mapping[tuple[str, str], Mapping[str, Attribute]]


class RegisteredEntity(Document):
    """One entity with attributes of a provider; without a type, of any type."""

    id: str
    type: str | None = None

    def matches(self, entity_id: str, entity_type: str) -> bool:
        """Whether an entity is meant."""
        return self.id == entity_id and self.type in (None, entity_type)


class DataProvided(Document):
    """Entities, and the attributes of each that a provider has."""

    entities: list[RegisteredEntity]
    attrs: list[str] = Field(min_length=1)


class _Address(Document):
    url: str = Field(pattern="^https?://[^/]")


class _Provider(Document):
    http: _Address
    supported_forwarding_mode: Literal["all"] = "all"
    legacy_forwarding: Literal[False] = False


class RegistrationDocument(Document):
    """What a client says of a registration."""

    description: str | None = None
    data_provided: DataProvided
    provider: _Provider


@dataclass(frozen=True, slots=True)
class Registration:
    """One context provider with its attributes.

    Attributes:
        path: Service path.
    """

    id: str
    path: str
    document: RegistrationDocument

    @property
    def provided(self) -> DataProvided:
        """Its entities and attributes."""
        return self.document.data_provided

    @property
    def url(self) -> str:
        """Address of the provider."""
        return self.document.provider.http.url

    def show(self) -> dict[str, Any]:
        """The registration as a client gets it."""
        return {"id": self.id, **self.document.show(), "status": "active"}


def read_registration(raw: object, path: str) -> Registration:
    """Read a registration from a ``POST``.

    Raises:
        FiwareError: 400 or 501.
    """
    return Registration(new_id(), path, read_document(RegistrationDocument, raw))


# --- choosing providers ------------------------------------------------------------

Registrations = Mapping[str, Registration]
Forwards = list[tuple[Registration, list[str]]]


def providers(
    registrations: Registrations,
    scope: Scope,
    entity_id: str,
    kind: str,
    names: Iterable[str],
) -> Forwards:
    """Names by registration; the oldest registration of a name gets it."""
    left = list(names)
    found = []
    for registration in registrations.values():
        provided = registration.provided
        mine = [name for name in left if name in provided.attrs]
        if (
            mine
            and under(scope.path, registration.path)
            and any(one.matches(entity_id, kind) for one in provided.entities)
        ):
            found.append((registration, mine))
            left = [name for name in left if name not in mine]
    return found


async def foreign(
    registrations: Registrations,
    scope: Scope,
    entity_id: str,
    entity_type: str,
    names: tuple[str, ...],
) -> Foreign:
    """Attributes that providers return for one entity, or for all (empty id).

    Args:
        registrations: Of the tenant.
        scope: Whose data.
        entity_id: One entity; empty for all.
        entity_type: Its type; empty for any.
        names: The attributes wanted; none for all.
    """
    asked = []
    for registration in registrations.values():
        provided = registration.provided
        attrs = [one for one in provided.attrs if not names or one in names]
        entities = [
            one
            for one in provided.entities
            if entity_id in ("", one.id)
            and (not entity_type or one.type in (entity_type, None))
        ]
        if attrs and entities and under(scope.path, registration.path):
            asked.append(_forward_query(registration, entities, attrs, scope))
    told: dict[tuple[str, str], dict[str, Attribute]] = {}
    for answer in await asyncio.gather(*asked):
        for key, attributes in answer.items():
            told[key] = {**attributes, **told.get(key, {})}
    return told


def bare_entities(
    registrations: Registrations, scope: Scope, names: tuple[str, ...]
) -> list[tuple[str, str]]:
    """Registered entities whose providers need not be queried, by id and type.

    When no provider has a requested attribute, Orion still lists the entities of its
    registrations.
    """
    if not names or "*" in names:
        return []
    return [
        (one.id, one.type or "")
        for registration in registrations.values()
        if not set(names) & set(registration.provided.attrs)
        and under(scope.path, registration.path)
        for one in registration.provided.entities
    ]


# --- asking them -------------------------------------------------------------------


async def forward_update(
    registration: Registration,
    entity_id: str,
    entity_type: str,
    changes: Mapping[str, EntityChange],
    scope: Scope,
) -> bool:
    """Send attributes to their provider; returns whether it accepted them."""
    written = {
        name: {
            "type": change.type or default_type(change.value),
            "value": change.value,
            "metadata": {},
        }
        for name, change in changes.items()
    }
    entity = {"id": entity_id, "type": entity_type, **written}
    body = orjson.dumps({"entities": [entity], "actionType": "update"})
    status, _ = await _ask(registration.url, "/op/update", body, scope)
    return 200 <= status < 300


async def _forward_query(
    registration: Registration,
    entities: Iterable[RegisteredEntity],
    names: list[str],
    scope: Scope,
) -> dict[tuple[str, str], dict[str, Attribute]]:
    """Query a provider for attributes; empty if it does not answer.

    Returns:
        Id and type of each returned entity, with its attributes.
    """
    asked = [one.show() for one in entities]
    body = orjson.dumps({"entities": asked, "attrs": names})
    resource = "/op/query?limit=20&offset=0&options=count"
    status, answer = await _ask(registration.url, resource, body, scope)
    if status != 200:
        return {}
    try:
        told = orjson.loads(answer)
    except orjson.JSONDecodeError:
        return {}
    return {
        (one["id"], one["type"]): _read_told(one, scope.now)
        for one in (told if isinstance(told, list) else ())
        if isinstance(one, dict) and {"id", "type"} <= one.keys()
    }


def _read_told(one: Mapping[str, Any], now: float) -> dict[str, Attribute]:
    return {
        name: Attribute(
            raw.get("type") or default_type(raw.get("value")),
            Value(raw.get("value")),
            {
                each: metadata_json(part.get("type", "Text"), part.get("value"))
                for each, part in raw.get("metadata", {}).items()
            },
            now,
            now,
        )
        for name, raw in one.items()
        if name not in ("id", "type") and isinstance(raw, dict)
    }


async def _ask(
    url: str, resource: str, body: bytes, scope: Scope
) -> tuple[int, bytes | str]:
    parts = urlsplit(url)
    headers = {
        "Host": parts.netloc,
        "User-Agent": AGENT,
        "Fiware-Service": scope.service,
        "Fiware-ServicePath": scope.path,
        "Accept": "application/json",
        "Content-Type": "application/json; charset=utf-8",
        "Fiware-Correlator": f"{scope.correlator}; cbfwd=1",
    }
    # Orion puts a slash between the two, whatever the address ends in.
    head = write_head((parts.path or "/") + resource, headers)
    target = NotificationTarget.from_url(url)
    return await exchange(target, head + with_length(body), PATIENCE_S)
