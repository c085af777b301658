"""``/v2/entities`` and the paths below it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from iveg.lab.embedded.changes import read_changes
from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.entities import Attribute, Entity, EntityChange, Scope
from iveg.lab.embedded.errors import (
    ATTRIBUTE_NOT_FOUND,
    bad_request,
    not_found,
    not_supported,
    too_many,
)
from iveg.lab.embedded.http_server import Response
from iveg.lab.embedded.ngsi_request import NgsiCall, read_id, read_value, split_names
from iveg.lab.embedded.orion_text import load_json, looks_clean, read_pattern
from iveg.lab.embedded.providers import bare_entities, foreign
from iveg.lab.embedded.views import write_entity

_NOT_DONE = ("q", "mq", "georel", "typePattern")
_ORDERS = ("", "id", "!id")


async def list_entities(broker: ContextBroker, call: NgsiCall) -> Response:
    """``GET /v2/entities``.

    A requested attribute may be missing: the entity is then listed without it, but one
    that was only registered is not.
    """
    wanted, view = _Wanted.read(call), call.view()
    tenant = broker.tenant(call.scope.service)
    found = tenant.entities.all(call.scope.path)
    told = await _ask_providers(broker, call, "", view.names)
    known = {(one.id, one.type) for one in found}
    strange = [key for key in told if key not in known]
    ghosts = [_ghost(call.scope, *key) for key in strange]
    if order := call.query.get("orderBy"):
        found.sort(key=lambda one: one.id, reverse=order.startswith("!"))
    chosen = [one for one in (*found, *ghosts) if wanted.fits(one)]
    shown = [
        write_entity(one, view, told.get((one.id, one.type), {})) for one in chosen
    ]
    return call.page(shown, len(chosen))


@dataclass(frozen=True, slots=True)
class _Wanted:
    """Filter of a list; empty or None fits all."""

    ids: tuple[str, ...]
    kinds: tuple[str, ...]
    id_pattern: re.Pattern[str] | None

    @classmethod
    def read(cls, call: NgsiCall) -> "_Wanted":
        """Read the filter from the query.

        Raises:
            FiwareError: 400 or 501.
        """
        query = call.query
        for name in query.keys() & set(_NOT_DONE):
            raise not_supported(f"parameter {name}")
        if query.get("orderBy", "") not in _ORDERS:
            raise not_supported("orderBy other than id")
        if "id" in query and "idPattern" in query:
            raise bad_request("Incompatible parameters: id, IdPattern")
        pattern = read_pattern(query.get("idPattern"), "idPattern")
        return cls(split_names(query.get("id")), split_names(call.kind), pattern)

    def fits(self, entity: Entity) -> bool:
        """Whether an entity fits the filter."""
        return (
            (not self.ids or entity.id in self.ids)
            and (not self.kinds or entity.type in self.kinds)
            and (self.id_pattern is None or bool(self.id_pattern.search(entity.id)))
        )


async def create_entity(broker: ContextBroker, call: NgsiCall) -> Response:
    """``POST /v2/entities``."""
    raw = call.read_object()
    entity_id, kind = read_id(raw)
    kind = kind or "Thing"
    changes = call.changes(raw)
    location = {"Location": f"/v2/entities/{entity_id}?type={kind}"}
    entities = broker.tenant(call.scope.service).entities
    known = entities.get(call.scope.path, entity_id, kind)
    if known is not None and "upsert" in call.options:
        broker.append(call.scope, known, changes)
        return Response(204, headers=location)
    broker.create(call.scope, entity_id, kind, changes)
    return Response(201, headers=location)


async def get_entity(broker: ContextBroker, call: NgsiCall) -> Response:
    """``GET /v2/entities/{id}``."""
    entity, told = await _whole(broker, call)
    return Response(200, write_entity(entity, call.view(), told))


async def get_attributes(broker: ContextBroker, call: NgsiCall) -> Response:
    """``GET /v2/entities/{id}/attrs``."""
    entity, told = await _whole(broker, call)
    return Response(200, write_entity(entity, call.view(), told, attributes_only=True))


async def _whole(
    broker: ContextBroker, call: NgsiCall
) -> tuple[Entity, Mapping[str, Attribute]]:
    """One entity with the attributes of its providers."""
    entity_id, view = call.parts[1], call.view()
    tenant = broker.tenant(call.scope.service)
    entity = broker.known(call.scope, entity_id, call.kind)
    told = await _ask_providers(broker, call, entity_id, view.names)
    if entity is not None:
        return entity, told.get((entity.id, entity.type), {})
    # With its type in the request, Orion answers that it does not know the entity.
    bare = (
        () if call.kind else bare_entities(tenant.registrations, call.scope, view.names)
    )
    known = [*told, *(key for key in bare if key[0] == entity_id)]
    if not known:
        raise not_found()
    return _ghost(call.scope, *known[0]), told.get(known[0], {})


async def _ask_providers(
    broker: ContextBroker, call: NgsiCall, entity_id: str, names: tuple[str, ...]
) -> Mapping[tuple[str, str], Mapping[str, Attribute]]:
    """Attributes that providers return for an entity, by its id and type."""
    if "skipForwarding" in call.options:
        return {}
    tenant = broker.tenant(call.scope.service)
    return await foreign(tenant.registrations, call.scope, entity_id, call.kind, names)


async def delete_entity(broker: ContextBroker, call: NgsiCall) -> Response:
    """``DELETE /v2/entities/{id}``."""
    entity = broker.find(call.scope, call.parts[1], call.kind)
    broker.delete(call.scope, entity)
    return Response(204)


async def append_attributes(broker: ContextBroker, call: NgsiCall) -> Response:
    """``POST /v2/entities/{id}/attrs``."""
    changes = call.changes(call.read_object())
    entity = broker.find(call.scope, call.parts[1], call.kind)
    broker.append(call.scope, entity, changes, forced="forcedUpdate" in call.options)
    return Response(204)


async def update_attributes(broker: ContextBroker, call: NgsiCall) -> Response:
    """``PATCH /v2/entities/{id}/attrs``."""
    changes = call.changes(call.read_object())
    if not changes:
        raise bad_request("empty payload")
    await _update(broker, call, changes)
    return Response(204)


async def replace_attributes(broker: ContextBroker, call: NgsiCall) -> Response:
    """``PUT /v2/entities/{id}/attrs``."""
    changes = call.changes(call.read_object())
    entity = broker.find(call.scope, call.parts[1], call.kind)
    broker.replace(call.scope, entity, changes)
    return Response(204)


async def get_attribute(broker: ContextBroker, call: NgsiCall) -> Response:
    """``GET /v2/entities/{id}/attrs/{name}``."""
    attribute = await _attribute(broker, call, call.parts[1])
    return Response(200, attribute.normalized(call.view().metadata))


async def get_value(broker: ContextBroker, call: NgsiCall) -> Response:
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


async def _attribute(
    broker: ContextBroker, call: NgsiCall, entity_id: str
) -> Attribute:
    name = call.parts[3]
    entity = broker.known(call.scope, entity_id, call.kind)
    if entity is not None and name in entity.attributes:
        return entity.attributes[name]
    told = await _ask_providers(broker, call, entity_id, (name,))
    for attributes in told.values():
        if name in attributes:
            return attributes[name]
    raise not_found(ATTRIBUTE_NOT_FOUND) if entity is not None else not_found()


async def put_attribute(broker: ContextBroker, call: NgsiCall) -> Response:
    """``PUT /v2/entities/{id}/attrs/{name}``."""
    await _update(
        broker, call, call.changes({call.parts[3]: load_json(call.request.body)})
    )
    return Response(204)


async def put_value(broker: ContextBroker, call: NgsiCall) -> Response:
    """``PUT /v2/entities/{id}/attrs/{name}/value``."""
    changes = read_changes(
        {call.parts[3]: read_value(call.request)},
        key_values=True,
        clean=looks_clean(call.request.body),
    )
    await _update(broker, call, changes)
    return Response(204)


async def delete_attribute(broker: ContextBroker, call: NgsiCall) -> Response:
    """``DELETE /v2/entities/{id}/attrs/{name}``."""
    entity = broker.find(call.scope, call.parts[1], call.kind)
    broker.delete_attribute(call.scope, entity, call.parts[3])
    return Response(204)


async def _update(
    broker: ContextBroker, call: NgsiCall, changes: Mapping[str, EntityChange]
) -> None:
    """Update attributes here or at providers; what is possible is done."""
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
