"""Registrations: attributes of other context providers, and requests to them.

A command is such an attribute.  An update of it goes to the provider as ``op/update``,
a read as ``op/query``; for a provider that is silent, slow or refuses, the client gets
an entity that does not exist.
"""

import asyncio
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

import orjson

from iveg.lab.embedded.entities import (
    Attribute,
    EntityChange,
    Value,
    default_type,
    metadata_json,
    under,
)
from iveg.lab.embedded.notifier import NotificationTarget, exchange
from iveg.lab.embedded.orion_text import bad_request
from iveg.lab.embedded.outbox import AGENT
from iveg.lab.embedded.scope import Scope
from iveg.lab.embedded.subscriptions import new_id

PATIENCE_S = 5.0
Foreign = Mapping[tuple[str, str], Mapping[str, Attribute]]


@dataclass(frozen=True, slots=True)
class Registration:
    """One context provider with its attributes.

    Attributes:
        path: Service path.
        url: Address of the provider.
        attributes: Names of its attributes; empty means all.
        entities: Entities with attributes of the provider.
        described: ``description``, if the client gave one.
    """

    id: str
    path: str
    url: str
    attributes: tuple[str, ...]
    entities: list[dict[str, str]]
    described: Mapping[str, Any]

    def concerns(self, entity_id: str, entity_type: str) -> bool:
        """Whether it has attributes of an entity; an unknown type fits none."""
        return any(
            _fits(one, "id", entity_id) and _fits(one, "type", entity_type)
            for one in self.entities
        )

    def show(self) -> dict[str, Any]:
        """The registration as a client gets it."""
        provided = {"entities": self.entities, "attrs": list(self.attributes)}
        provider = {
            "http": {"url": self.url},
            "supportedForwardingMode": "all",
            "legacyForwarding": False,
        }
        return {
            "id": self.id,
            **self.described,
            "dataProvided": provided,
            "provider": provider,
            "status": "active",
        }


def _fits(one: Mapping[str, str], name: str, text: str) -> bool:
    if name in one:
        return one[name] == text
    pattern = one.get(f"{name}Pattern")
    return pattern is None or re.search(pattern, text) is not None


def read_registration(raw: Any, path: str) -> Registration:
    """Read a registration from a ``POST``.

    Raises:
        NgsiError: 400.
    """
    document = raw if isinstance(raw, dict) else {}
    provided, provider = document.get("dataProvided"), document.get("provider")
    if not isinstance(provided, dict) or not isinstance(provided.get("entities"), list):
        raise bad_request("/dataProvided/ field missing in registration")
    if not isinstance(provider, dict) or not isinstance(provider.get("http"), dict):
        raise bad_request("/provider/ field missing in registration")
    if not urlsplit(str(provider["http"].get("url", ""))).hostname:
        raise bad_request("/url/ field missing in registration")
    return Registration(
        new_id(),
        path,
        provider["http"]["url"],
        tuple(provided.get("attrs") or ()),
        provided["entities"],
        {name: one for name, one in document.items() if name == "description"},
    )


# --- choosing providers ------------------------------------------------------------

Registrations = Mapping[str, Registration]


def providers(
    registrations: Registrations,
    scope: Scope,
    entity_id: str,
    kind: str,
    names: Iterable[str],
) -> list[tuple[Registration, list[str]]]:
    """Names by registration; the oldest registration of a name gets it."""
    left = list(names)
    found = []
    for registration in registrations.values():
        mine = [
            name
            for name in left
            if not registration.attributes or name in registration.attributes
        ]
        if (
            mine
            and under(scope.path, registration.path)
            and registration.concerns(entity_id, kind)
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
        attrs = [n for n in registration.attributes if not names or n in names]
        entities = [
            one
            for one in registration.entities
            if "id" in one
            and (not entity_id or one["id"] == entity_id)
            and (not entity_type or one.get("type") in (entity_type, None))
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
        (one["id"], one.get("type", ""))
        for registration in registrations.values()
        if registration.attributes
        and not set(names) & set(registration.attributes)
        and under(scope.path, registration.path)
        for one in registration.entities
        if "id" in one
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
    entities: Iterable[Mapping[str, str]],
    names: Iterable[str],
    scope: Scope,
) -> dict[tuple[str, str], dict[str, Attribute]]:
    """Query a provider for attributes; empty if it does not answer.

    Returns:
        Id and type of each returned entity, with its attributes.
    """
    body = orjson.dumps({"entities": list(entities), "attrs": list(names)})
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
    head = "\r\n".join(
        (
            # Orion puts a slash between the two, whatever the address ends in.
            f"POST {parts.path or '/'}{resource} HTTP/1.1",
            f"Host: {parts.netloc}",
            f"User-Agent: {AGENT}",
            f"Fiware-Service: {scope.service}",
            f"Fiware-ServicePath: {scope.path}",
            "Accept: application/json",
            "Content-Type: application/json; charset=utf-8",
            f"Content-Length: {len(body)}",
            f"Fiware-Correlator: {scope.correlator}; cbfwd=1",
            "",
            "",
        )
    )
    return await exchange(
        NotificationTarget.from_url(url), head.encode() + body, PATIENCE_S
    )
