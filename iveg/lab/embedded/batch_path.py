"""``/v2/op/update``: many entities in one request."""

from typing import Literal

from pydantic import Field

from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.documents import Document, read_document
from iveg.lab.embedded.errors import not_supported
from iveg.lab.embedded.http_server import Response
from iveg.lab.embedded.ngsi_request import NgsiCall, read_id
from iveg.lab.embedded.outcomes import raise_for_batch

_NOT_DONE = ("appendStrict", "delete", "replace")


class _Batch(Document):
    entities: list[dict[str, object]] = Field(min_length=1)
    action_type: Literal["append", "update"]


async def batch_update(broker: ContextBroker, call: NgsiCall) -> Response:
    """``POST /v2/op/update``: executes what is possible and reports what is not."""
    raw = call.read_object()
    if raw.get("actionType") in _NOT_DONE:
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
