"""``/v2/op/update``: many entities in one request."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any

from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.entities import EntityChange
from iveg.lab.embedded.http_server import Response
from iveg.lab.embedded.ngsi_request import Call, read_id
from iveg.lab.embedded.orion_text import bad_request
from iveg.lab.embedded.outcomes import EXISTING, MISSING, Outcome, raise_for_batch

_OLD_WORDS = {"UPDATE": "update", "APPEND": "append", "DELETE": "delete",
              "APPEND_STRICT": "appendStrict", "REPLACE": "replace"}  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Item:
    """One entity of a batch; ``kind`` is empty where the request names no type."""

    id: str
    kind: str
    changes: Mapping[str, EntityChange]


async def batch_update(broker: ContextBroker, call: Call) -> Response:
    """``POST /v2/op/update``: executes what is possible and reports what is not."""
    raw = _checked(call.object())
    items = [_read_item(call, one) for one in raw["entities"]]
    action = _OLD_WORDS.get(raw["actionType"], raw["actionType"])
    outcomes = [await _ACTIONS[action](broker, call, item) for item in items]
    raise_for_batch(outcomes, EXISTING if action == "appendStrict" else MISSING)
    return Response(204)


def _checked(raw: dict[str, Any]) -> dict[str, Any]:
    """The request, if Orion would process it further.

    Raises:
        NgsiError: 400, with Orion's sentence, including its typing error.
    """
    if not raw:
        raise bad_request("empty payload")
    for name in ("entities", "actionType"):
        if name not in raw:
            raise bad_request(
                f"Invalid JSON payload, mandatory field /{name}/ not found"
            )
    for name in raw:
        if name not in ("entities", "actionType"):
            raise bad_request(f"Unrecognized field in JSON payload: /{name}/")
    action = raw["actionType"]
    if not isinstance(action, str) or _OLD_WORDS.get(action, action) not in _ACTIONS:
        raise bad_request(
            "invalid update action type: right ones are: "
            "append, appendStric, delete, replace, update"
        )
    if not isinstance(raw["entities"], list):
        raise bad_request("not a JSON array")
    if not raw["entities"]:
        raise bad_request("empty entities vector")
    return raw


def _read_item(call: Call, raw: Any) -> _Item:
    if not isinstance(raw, dict):
        raise bad_request("entity is not a JSON object")
    if "id" not in raw:
        raise bad_request("nor /id/ nor /idPattern/ present")
    entity_id, kind = read_id(raw)
    return _Item(entity_id, kind if "type" in raw else "", call.changes(raw))


async def _update(broker: ContextBroker, call: Call, item: _Item) -> Outcome:
    return await broker.update(call.scope, item.id, item.kind, item.changes)


async def _append(broker: ContextBroker, call: Call, item: _Item) -> Outcome:
    kind = item.kind or "Thing"
    broker.upsert(call.scope, item.id, kind, item.changes)
    return Outcome(item.id, item.kind, kind, exists=True)


async def _append_strict(broker: ContextBroker, call: Call, item: _Item) -> Outcome:
    known = broker.known(call.scope, item.id, item.kind)
    if known is None:
        return await _append(broker, call, item)
    return broker.append_new(call.scope, known, item.changes, item.kind)


async def _replace(broker: ContextBroker, call: Call, item: _Item) -> Outcome:
    known = broker.known(call.scope, item.id, item.kind)
    if known is not None:
        broker.replace(call.scope, known, item.changes)
    return Outcome(item.id, item.kind, item.kind, exists=known is not None)


async def _delete(broker: ContextBroker, call: Call, item: _Item) -> Outcome:
    known = broker.known(call.scope, item.id, item.kind)
    missing: tuple[str, ...] = ()
    if known is not None and item.changes:
        missing = broker.delete_attributes(call.scope, known, item.changes)
    elif known is not None:
        broker.delete(call.scope, known)
    return Outcome(
        item.id,
        item.kind,
        item.kind,
        exists=known is not None,
        updated=tuple(name for name in item.changes if name not in missing),
        refused=missing,
    )


_Action = Callable[[ContextBroker, Call, _Item], Awaitable[Outcome]]
_ACTIONS: Mapping[str, _Action] = {
    "append": _append,
    "appendStrict": _append_strict,
    "update": _update,
    "replace": _replace,
    "delete": _delete,
}
