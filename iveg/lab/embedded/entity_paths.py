"""``/v2/entities`` and the paths below it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.entities import Attribute, Entity, EntityChange, read_changes
from iveg.lab.embedded.http_server import Response
from iveg.lab.embedded.ngsi_request import (
    Call,
    names,
    paging,
    read_id,
    read_value,
)
from iveg.lab.embedded.orion_text import (
    ATTRIBUTE_NOT_FOUND,
    bad_request,
    looks_clean,
    not_found,
    read_pattern,
    too_many,
)
from iveg.lab.embedded.outcomes import EXISTING
from iveg.lab.embedded.query import matches_query, ordered
from iveg.lab.embedded.registrations import bare_entities, foreign
from iveg.lab.embedded.scope import Scope
from iveg.lab.embedded.views import write_attributes, write_entity


async def list_entities(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/entities``.

    A requested attribute may be missing: the entity is then listed without it.
    """
    query = call.request.query
    limit, offset = paging(query)
    wanted = _Wanted.read(call)
    tenant = broker.tenant(call.scope.service)
    found = tenant.entities.all(call.scope.path)
    chosen = [
        one
        for one in found
        if wanted.fits(one.id, one.type) and matches_query(one, query.get("q", ""))
    ]
    chosen = ordered(chosen, query.get("orderBy", ""))
    view = call.view()
    told = await _ask_providers(broker, call, "", view.names)
    known = {(one.id, one.type) for one in found}
    strange = [key for key in told if key not in known and wanted.fits(*key)]
    bare = [
        key
        for key in bare_entities(tenant.registrations, call.scope, view.names)
        if key not in known and key not in told and wanted.fits(*key)
    ]
    shown = [
        write_entity(one, view, told.get((one.id, one.type)))
        for one in (*chosen, *(_ghost(call.scope, *key) for key in (*strange, *bare)))
    ]
    response = Response(200, b"[%b]" % b",".join(shown[offset : offset + limit]))
    if "count" in call.options:
        response.headers["Fiware-Total-Count"] = str(len(chosen) + len(strange))
    return response


@dataclass(frozen=True, slots=True)
class _Wanted:
    """Filter of a list; empty or None fits all."""

    ids: tuple[str, ...]
    kinds: tuple[str, ...]
    id_pattern: re.Pattern[str] | None
    kind_pattern: re.Pattern[str] | None

    @classmethod
    def read(cls, call: Call) -> "_Wanted":
        """Read the filter from the query.

        Raises:
            NgsiError: 400.
        """
        query = call.request.query
        for one in ("id", "type"):
            if one in query and f"{one}Pattern" in query:
                name = "IdPattern" if one == "id" else "typePattern"
                raise bad_request(f"Incompatible parameters: {one}, {name}")
        return cls(
            names(query.get("id")),
            names(query.get("type")),
            read_pattern(query.get("idPattern"), "idPattern"),
            read_pattern(query.get("typePattern"), "typePattern"),
        )

    def fits(self, entity_id: str, kind: str) -> bool:
        """Whether an entity fits the filter."""
        return (
            (not self.ids or entity_id in self.ids)
            and (not self.kinds or kind in self.kinds)
            and (self.id_pattern is None or bool(self.id_pattern.search(entity_id)))
            and (self.kind_pattern is None or bool(self.kind_pattern.search(kind)))
        )


async def create_entity(broker: ContextBroker, call: Call) -> Response:
    """``POST /v2/entities``."""
    raw = call.object()
    entity_id, kind = read_id(raw)
    changes = call.changes(raw)
    location = {"Location": f"/v2/entities/{entity_id}?type={kind}"}
    if "upsert" in call.options:
        known = broker.tenant(call.scope.service).entities.get(
            call.scope.path, entity_id, kind
        )
        broker.upsert(call.scope, entity_id, kind, changes)
        return Response(201 if known is None else 204, headers=location)
    broker.create(call.scope, entity_id, kind, changes)
    return Response(201, headers=location)


async def get_entity(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/entities/{id}``."""
    entity, told = await _whole(broker, call)
    return Response(200, write_entity(entity, call.view(), told))


async def get_attributes(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/entities/{id}/attrs``."""
    entity, told = await _whole(broker, call)
    return Response(200, write_attributes(entity, call.view(), told))


async def _whole(
    broker: ContextBroker, call: Call
) -> tuple[Entity, Mapping[str, Attribute]]:
    """One entity with the attributes of its providers."""
    entity_id, view = call.parts[1], call.view()
    tenant = broker.tenant(call.scope.service)
    entity = broker.known(call.scope, entity_id, call.kind)
    told = await _ask_providers(broker, call, entity_id, view.names)
    if entity is not None:
        return entity, told.get((entity.id, entity.type), {})
    for key, attributes in told.items():
        return _ghost(call.scope, *key), attributes
    # With its type in the request, Orion answers that it does not know the entity.
    for key in (
        bare_entities(tenant.registrations, call.scope, view.names)
        if not call.kind
        else ()
    ):
        if key[0] == entity_id:
            return _ghost(call.scope, *key), {}
    raise not_found()


async def _ask_providers(
    broker: ContextBroker, call: Call, entity_id: str, names: tuple[str, ...]
) -> Mapping[tuple[str, str], Mapping[str, Attribute]]:
    """Attributes that providers return for an entity, by its id and type."""
    if "skipForwarding" in call.options:
        return {}
    tenant = broker.tenant(call.scope.service)
    return await foreign(tenant.registrations, call.scope, entity_id, call.kind, names)


async def delete_entity(broker: ContextBroker, call: Call) -> Response:
    """``DELETE /v2/entities/{id}``."""
    entity = broker.find(call.scope, call.parts[1], call.kind)
    broker.delete(call.scope, entity)
    return Response(204)


async def append_attributes(broker: ContextBroker, call: Call) -> Response:
    """``POST /v2/entities/{id}/attrs``."""
    changes = call.changes(call.object())
    entity = broker.find(call.scope, call.parts[1], call.kind)
    if "append" in call.options:
        outcome = broker.append_new(call.scope, entity, changes, call.kind)
        outcome.raise_for_one(EXISTING)
    else:
        forced = "forcedUpdate" in call.options
        broker.append(call.scope, entity, changes, forced=forced)
    return Response(204)


async def update_attributes(broker: ContextBroker, call: Call) -> Response:
    """``PATCH /v2/entities/{id}/attrs``."""
    changes = call.changes(call.object())
    if not changes:
        raise bad_request("empty payload")
    await _update(broker, call, changes)
    return Response(204)


async def replace_attributes(broker: ContextBroker, call: Call) -> Response:
    """``PUT /v2/entities/{id}/attrs``."""
    changes = call.changes(call.object())
    entity = broker.find(call.scope, call.parts[1], call.kind)
    broker.replace(call.scope, entity, changes)
    return Response(204)


# --- one attribute or its bare value --------------------------------------------


async def get_attribute(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/entities/{id}/attrs/{name}``."""
    attribute = await _attribute(broker, call, call.parts[1])
    return Response(200, attribute.normalized(call.view().metadata))


async def get_value(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/entities/{id}/attrs/{name}/value``.

    Orion 4.3 to 4.7 takes the id for a pattern here, so that ``AGI`` is also
    ``AGI2``; a client must be able to meet that.
    """
    near = [
        one.id
        for one in broker.tenant(call.scope.service).entities.all(call.scope.path)
        if re.search(call.parts[1], one.id) and (not call.kind or one.type == call.kind)
    ]
    if len(near) > 1:
        raise too_many()
    json = (await _attribute(broker, call, near[0] if near else call.parts[1])).json
    structured = json[:1] in b"[{"
    return Response(
        200, json, content_type="application/json" if structured else "text/plain"
    )


async def _attribute(broker: ContextBroker, call: Call, entity_id: str) -> Attribute:
    name = call.parts[3]
    entity = broker.known(call.scope, entity_id, call.kind)
    if entity is not None and name in entity.attributes:
        return entity.attributes[name]
    told = await _ask_providers(broker, call, entity_id, (name,))
    for attributes in told.values():
        if name in attributes:
            return attributes[name]
    raise not_found(ATTRIBUTE_NOT_FOUND) if entity is not None else not_found()


async def put_attribute(broker: ContextBroker, call: Call) -> Response:
    """``PUT /v2/entities/{id}/attrs/{name}``."""
    await _update(broker, call, call.changes({call.parts[3]: call.json()}))
    return Response(204)


async def put_value(broker: ContextBroker, call: Call) -> Response:
    """``PUT /v2/entities/{id}/attrs/{name}/value``."""
    value = read_value(call)
    changes = read_changes(
        {call.parts[3]: {"value": value}},
        key_values=False,
        clean=looks_clean(call.request.body.strip(b'"')),
    )
    await _update(broker, call, changes)
    return Response(204)


async def delete_attribute(broker: ContextBroker, call: Call) -> Response:
    """``DELETE /v2/entities/{id}/attrs/{name}``."""
    entity = broker.find(call.scope, call.parts[1], call.kind)
    if broker.delete_attributes(call.scope, entity, [call.parts[3]]):
        raise not_found(ATTRIBUTE_NOT_FOUND)
    return Response(204)


# --- what they share --------------------------------------------------------------


async def _update(
    broker: ContextBroker, call: Call, changes: Mapping[str, EntityChange]
) -> None:
    """Update attributes here or at providers, according to the options.

    Raises:
        NgsiError: 404 or 422, as Orion; the possible part is done.
    """
    outcome = await broker.update(
        call.scope,
        call.parts[1],
        call.kind,
        changes,
        forced="forcedUpdate" in call.options,
    )
    outcome.raise_for_one()


def _ghost(scope: Scope, entity_id: str, kind: str) -> Entity:
    """An entity that is known only to a provider."""
    return Entity(entity_id, kind, scope.path, scope.now, scope.now)
