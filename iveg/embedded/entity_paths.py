"""``/v2/entities`` and what lies below it."""

from collections.abc import Mapping

from iveg.embedded.context_broker import ContextBroker, Scope
from iveg.embedded.entities import Attribute, Change, Entity
from iveg.embedded.http_server import Response
from iveg.embedded.ngsi_request import Call, names, paging, pattern, read_id
from iveg.embedded.orion_errors import bad_request, not_found
from iveg.embedded.query import matches_query, ordered
from iveg.embedded.views import write_attributes, write_entity


async def list_entities(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/entities``."""
    query = call.request.query
    limit, offset = paging(query)
    chosen = _chosen(broker, call)
    view = call.view()
    told = await ask_providers(broker, call, "", view.names)
    known = {(one.id, one.type) for one in chosen}
    wanted_id = set(names(query.get("id")))
    for entity_id, kind in told:
        strange = (entity_id, kind) not in known
        if strange and (not wanted_id or entity_id in wanted_id):
            chosen.append(_ghost(call.scope, entity_id, kind))
    # Asked for by name, attributes must be there: an entity with none is left out.
    shown = [
        write_entity(one, view, told.get((one.id, one.type)))
        for one in chosen
        if not view.names or _has_any(one, view.names) or told.get((one.id, one.type))
    ]
    response = Response(200, b"[%b]" % b",".join(shown[offset : offset + limit]))
    if "count" in call.options:
        response.headers["Fiware-Total-Count"] = str(len(shown))
    return response


def _chosen(broker: ContextBroker, call: Call) -> list[Entity]:
    query = call.request.query
    for one in ("id", "type"):
        if one in query and f"{one}Pattern" in query:
            name = "IdPattern" if one == "id" else "typePattern"
            raise bad_request(f"Incompatible parameters: {one}, {name}")
    ids, kinds = names(query.get("id")), names(query.get("type"))
    id_pattern = pattern(query.get("idPattern"), "idPattern")
    kind_pattern = pattern(query.get("typePattern"), "typePattern")
    found = [
        one
        for one in broker.tenant(call.scope.service).entities.all(call.scope.path)
        if (not ids or one.id in ids)
        and (not kinds or one.type in kinds)
        and (id_pattern is None or id_pattern.search(one.id))
        and (kind_pattern is None or kind_pattern.search(one.type))
        and matches_query(one, query.get("q", ""))
    ]
    return ordered(found, query.get("orderBy", ""))


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
    """One entity with what its providers tell of it."""
    entity_id, view = call.parts[1], call.view()
    entity = broker.tenant(call.scope.service).entities.find(
        call.scope.path, entity_id, call.kind
    )
    told = await ask_providers(broker, call, entity_id, view.names)
    if entity is not None:
        return entity, told.get((entity.id, entity.type), {})
    if not told:
        raise not_found()
    key, attributes = next(iter(told.items()))
    return _ghost(call.scope, *key), attributes


async def ask_providers(
    broker: ContextBroker, call: Call, entity_id: str, names: tuple[str, ...]
) -> Mapping[tuple[str, str], Mapping[str, Attribute]]:
    """What providers tell of an entity's attributes, by its id and type."""
    if "skipForwarding" in call.options:
        return {}
    return await broker.foreign(call.scope, entity_id, call.kind, names)


async def delete_entity(broker: ContextBroker, call: Call) -> Response:
    """``DELETE /v2/entities/{id}``."""
    entity = broker.find(call.scope, call.parts[1], call.kind)
    broker.delete(call.scope, entity)
    return Response(204)


async def append_attributes(broker: ContextBroker, call: Call) -> Response:
    """``POST /v2/entities/{id}/attrs``."""
    changes = call.changes(call.object())
    entity = broker.find(call.scope, call.parts[1], call.kind)
    broker.append(
        call.scope,
        entity,
        changes,
        forced="forcedUpdate" in call.options,
        strict="append" in call.options,
    )
    return Response(204)


async def update_attributes(broker: ContextBroker, call: Call) -> Response:
    """``PATCH /v2/entities/{id}/attrs``."""
    changes = call.changes(call.object())
    if not changes:
        raise bad_request("empty payload")
    await update(broker, call, changes)
    return Response(204)


async def replace_attributes(broker: ContextBroker, call: Call) -> Response:
    """``PUT /v2/entities/{id}/attrs``."""
    changes = call.changes(call.object())
    entity = broker.find(call.scope, call.parts[1], call.kind)
    broker.replace(call.scope, entity, changes)
    return Response(204)


async def update(
    broker: ContextBroker, call: Call, changes: Mapping[str, Change]
) -> None:
    """Change what the entity or its providers have, as the options say."""
    await broker.update(
        call.scope,
        call.parts[1],
        call.kind,
        changes,
        forced="forcedUpdate" in call.options,
    )


def _ghost(scope: Scope, entity_id: str, kind: str) -> Entity:
    """An entity that only a provider knows."""
    return Entity(entity_id, kind, scope.path, scope.now, scope.now)


def _has_any(entity: Entity, names: tuple[str, ...]) -> bool:
    return "*" in names or any(
        name in entity.attributes or name.startswith("date") for name in names
    )
