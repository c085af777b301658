"""``/v2/entities`` and the paths below it, and many of them in ``/v2/op/update``."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.documents import Document, read_document
from iveg.lab.embedded.entities import Attribute, Entity, EntityChange, Scope
from iveg.lab.embedded.errors import (
    bad_request,
    not_found,
    not_supported,
)
from iveg.lab.embedded.http_server import Response
from iveg.lab.embedded.ngsi_request import NgsiCall, read_id, split_names
from iveg.lab.embedded.orion_text import read_pattern
from iveg.lab.embedded.outcomes import raise_for_batch
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
    provided = await _ask_providers(broker, call, "", view.names)
    known = {(one.id, one.type) for one in found}
    strange = [key for key in provided if key not in known]
    ghosts = [_ghost(call.scope, *key) for key in strange]
    if order := call.query.get("orderBy"):
        found.sort(key=lambda one: one.id, reverse=order.startswith("!"))
    chosen = [one for one in (*found, *ghosts) if wanted.fits(one)]
    shown = [
        write_entity(one, view, provided.get((one.id, one.type), {})) for one in chosen
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
    entity, provided = await _whole(broker, call)
    return Response(200, write_entity(entity, call.view(), provided))


async def _whole(
    broker: ContextBroker, call: NgsiCall
) -> tuple[Entity, Mapping[str, Attribute]]:
    """One entity with the attributes of its providers."""
    entity_id, view = call.parts[1], call.view()
    tenant = broker.tenant(call.scope.service)
    entity = broker.known(call.scope, entity_id, call.kind)
    provided = await _ask_providers(broker, call, entity_id, view.names)
    if entity is not None:
        return entity, provided.get((entity.id, entity.type), {})
    # With its type in the request, Orion answers that it does not know the entity.
    bare = (
        () if call.kind else bare_entities(tenant.registrations, call.scope, view.names)
    )
    known = [*provided, *(key for key in bare if key[0] == entity_id)]
    if not known:
        raise not_found()
    return _ghost(call.scope, *known[0]), provided.get(known[0], {})


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


async def update_attributes(broker: ContextBroker, call: NgsiCall) -> Response:
    """``PATCH /v2/entities/{id}/attrs``."""
    changes = call.changes(call.read_object())
    if not changes:
        raise bad_request("empty payload")
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


# --- many entities in one request --------------------------------------------------

_BATCHES_NOT_DONE = ("appendStrict", "delete", "replace")


class _Batch(Document):
    entities: list[dict[str, object]] = Field(min_length=1)
    action_type: Literal["append", "update"]


async def batch_update(broker: ContextBroker, call: NgsiCall) -> Response:
    """``POST /v2/op/update``: executes what is possible and reports what is not."""
    raw = call.read_object()
    if raw.get("actionType") in _BATCHES_NOT_DONE:
        raise not_supported(f"actionType {raw['actionType']}")
    batch = read_document(_Batch, raw)
    items = [(*read_id(one), call.changes(one)) for one in batch.entities]
    if batch.action_type == "append":
        for entity_id, kind, changes in items:
            broker.upsert(call.scope, entity_id, kind or "Thing", changes)
    else:
        outcomes = [await broker.update(call.scope, *item) for item in items]
        raise_for_batch(outcomes)
    return Response(204)
