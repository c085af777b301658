"""``/v2/op/update``: many entities in one request."""

from collections.abc import Mapping

from iveg.embedded.context_broker import ContextBroker
from iveg.embedded.entities import Change, Entity
from iveg.embedded.http_server import Response
from iveg.embedded.ngsi_request import Call, read_id
from iveg.embedded.orion_errors import bad_request

_ACTIONS = {"UPDATE": "update", "APPEND": "append", "DELETE": "delete",
            "APPEND_STRICT": "appendStrict", "REPLACE": "replace"}  # fmt: skip


async def batch_update(broker: ContextBroker, call: Call) -> Response:
    """``POST /v2/op/update``."""
    raw = call.object()
    action = _ACTIONS.get(str(raw.get("actionType")), raw.get("actionType"))
    entities = raw.get("entities")
    if not isinstance(entities, list) or not entities:
        raise bad_request("empty update action payload")
    read = [(*read_id(one), call.changes(one)) for one in entities]
    if action == "update":
        await broker.update_many(call.scope, read)
    elif action in ("append", "appendStrict"):
        for entity_id, kind, changes in read:
            _append_one(broker, call, entity_id, kind, changes, action)
    elif action in ("replace", "delete"):
        for entity_id, kind, changes in read:
            entity = broker.find(call.scope, entity_id, kind)
            _change_one(broker, call, entity, changes, action)
    else:
        raise bad_request("invalid update action type")
    return Response(204)


def _append_one(
    broker: ContextBroker,
    call: Call,
    entity_id: str,
    kind: str,
    changes: Mapping[str, Change],
    action: str,
) -> None:
    known = broker.tenant(call.scope.service).entities.get(
        call.scope.path, entity_id, kind
    )
    if known is None or action == "append":
        broker.upsert(call.scope, entity_id, kind, changes)
    else:
        broker.append(call.scope, known, changes, strict=True)


def _change_one(
    broker: ContextBroker,
    call: Call,
    entity: Entity,
    changes: Mapping[str, Change],
    action: str,
) -> None:
    if action == "replace":
        broker.replace(call.scope, entity, changes)
    elif changes:
        broker.delete_attributes(call.scope, entity, changes)
    else:
        broker.delete(call.scope, entity)
