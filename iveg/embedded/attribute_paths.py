"""``/v2/entities/{id}/attrs/{name}``: one attribute or its bare value."""

import re

from iveg.embedded.context_broker import ContextBroker
from iveg.embedded.entities import Attribute, read_changes
from iveg.embedded.entity_paths import ask_providers, update
from iveg.embedded.http_server import Response
from iveg.embedded.ngsi_request import Call, read_value
from iveg.embedded.orion_errors import ATTRIBUTE_NOT_FOUND, not_found, too_many
from iveg.embedded.orion_text import looks_clean


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
    entity = broker.tenant(call.scope.service).entities.find(
        call.scope.path, entity_id, call.kind
    )
    if entity is not None and name in entity.attributes:
        return entity.attributes[name]
    told = await ask_providers(broker, call, entity_id, (name,))
    for attributes in told.values():
        if name in attributes:
            return attributes[name]
    raise not_found(ATTRIBUTE_NOT_FOUND) if entity is not None else not_found()


async def put_attribute(broker: ContextBroker, call: Call) -> Response:
    """``PUT /v2/entities/{id}/attrs/{name}``."""
    await update(broker, call, call.changes({call.parts[3]: call.json()}))
    return Response(204)


async def put_value(broker: ContextBroker, call: Call) -> Response:
    """``PUT /v2/entities/{id}/attrs/{name}/value``."""
    value = read_value(call)
    changes = read_changes(
        {call.parts[3]: {"value": value}},
        key_values=False,
        clean=looks_clean(call.request.body.strip(b'"')),
    )
    await update(broker, call, changes)
    return Response(204)


async def delete_attribute(broker: ContextBroker, call: Call) -> Response:
    """``DELETE /v2/entities/{id}/attrs/{name}``."""
    entity = broker.find(call.scope, call.parts[1], call.kind)
    if broker.delete_attributes(call.scope, entity, [call.parts[3]]):
        raise not_found(ATTRIBUTE_NOT_FOUND)
    return Response(204)
