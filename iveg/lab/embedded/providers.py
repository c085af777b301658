"""Attributes of other context providers, and requests to them.

A command is such an attribute.  An update of it goes to the provider as ``op/update``,
a read as ``op/query``; for a provider that is silent, slow or refuses, the client gets
an entity that does not exist.
"""

import asyncio
from collections.abc import Iterable, Mapping
from urllib.parse import urlsplit

import orjson

from iveg.lab.embedded.entities import (
    Attribute,
    EntityChange,
    Scope,
    Value,
    default_type,
    metadata_json,
    under,
)
from iveg.lab.embedded.http_requests import (
    AGENT,
    NotificationTarget,
    with_length,
    write_head,
)
from iveg.lab.embedded.notifier import exchange
from iveg.lab.embedded.registrations import RegisteredEntity, Registration

PATIENCE_S = 5.0
Foreign = Mapping[tuple[str, str], Mapping[str, Attribute]]
Registrations = Mapping[str, Registration]


async def forward_updates(
    registrations: Registrations,
    scope: Scope,
    entity_id: str,
    kind: str,
    changes: Mapping[str, EntityChange],
) -> tuple[list[str], list[str]]:
    """Send changes of one entity to its providers; an attribute goes to the oldest.

    Returns:
        The attributes that were accepted, and those that were not.
    """
    left = dict(changes)
    shares, answers = [], []
    for registration in registrations.values():
        provided = registration.provided
        mine = [name for name in left if name in provided.attrs]
        near = under(scope.path, registration.path)
        if mine and near and provided.concerns(entity_id, kind):
            share = {name: left.pop(name) for name in mine}
            answers.append(_forward_update(registration, entity_id, kind, share, scope))
            shares.append(mine)
    passed: list[str] = []
    failed: list[str] = []
    for mine, accepted in zip(shares, await asyncio.gather(*answers), strict=True):
        (passed if accepted else failed).extend(mine)
    return passed, failed


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
    merged: dict[tuple[str, str], dict[str, Attribute]] = {}
    for answer in await asyncio.gather(*asked):
        for key, attributes in answer.items():
            merged[key] = {**attributes, **merged.get(key, {})}
    return merged


def bare_entities(
    registrations: Registrations, scope: Scope, names: tuple[str, ...]
) -> list[tuple[str, str]]:
    """Registered entities whose providers need not be queried, by id and type.

    When no provider has a requested attribute, Orion still finds an entity of its
    registrations by its id.
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


async def _forward_update(
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
        document = orjson.loads(answer)
    except orjson.JSONDecodeError:
        return {}
    return {
        (one["id"], one["type"]): _read_attributes(one, scope.now)
        for one in (document if isinstance(document, list) else ())
        if isinstance(one, dict) and {"id", "type"} <= one.keys()
    }


def _read_attributes(one: Mapping[str, object], now: float) -> dict[str, Attribute]:
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
