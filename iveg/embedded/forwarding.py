"""Updates and queries that the broker forwards to providers of registrations."""

import asyncio
from collections.abc import Iterable, Mapping

from iveg.embedded.entities import Attribute, under
from iveg.embedded.registrations import Registration, forward_query
from iveg.embedded.scope import Scope
from iveg.embedded.tenants import Tenant

Foreign = Mapping[tuple[str, str], Mapping[str, Attribute]]


def providers(
    tenant: Tenant, scope: Scope, entity_id: str, kind: str, names: Iterable[str]
) -> list[tuple[Registration, list[str]]]:
    """Names by registration; the oldest registration of a name gets it."""
    left = list(names)
    found = []
    for registration in tenant.registrations.values():
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
    tenant: Tenant,
    scope: Scope,
    entity_id: str,
    entity_type: str,
    names: tuple[str, ...],
) -> Foreign:
    """Attributes that providers return for one entity, or for all (empty id).

    Args:
        tenant: Whose registrations.
        scope: Whose data.
        entity_id: One entity; empty for all.
        entity_type: Its type; empty for any.
        names: The attributes wanted; none for all.
    """
    found = tenant.registrations.values()
    asked = []
    for registration in found:
        attrs = [n for n in registration.attributes if not names or n in names]
        entities = [
            one
            for one in registration.entities
            if "id" in one
            and (not entity_id or one["id"] == entity_id)
            and (not entity_type or one.get("type") in (entity_type, None))
        ]
        if attrs and entities and under(scope.path, registration.path):
            asked.append(forward_query(registration, entities, attrs, scope))
    told: dict[tuple[str, str], dict[str, Attribute]] = {}
    for answer in await asyncio.gather(*asked):
        for key, attributes in answer.items():
            told[key] = {**attributes, **told.get(key, {})}
    return told


def bare_entities(
    tenant: Tenant, scope: Scope, names: tuple[str, ...]
) -> list[tuple[str, str]]:
    """Registered entities whose providers need not be queried, by id and type.

    When no provider has a requested attribute, Orion still lists the entities of its
    registrations.
    """
    if not names or "*" in names:
        return []
    return [
        (one["id"], one.get("type", ""))
        for registration in tenant.registrations.values()
        if registration.attributes
        and not set(names) & set(registration.attributes)
        and under(scope.path, registration.path)
        for one in registration.entities
        if "id" in one
    ]
