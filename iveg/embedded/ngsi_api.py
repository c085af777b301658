"""NGSI-v2 over HTTP: paths and options in, Orion's statuses and sentences out."""

import re
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

import orjson

from iveg.adapters import clock
from iveg.embedded.context_broker import ContextBroker, Scope
from iveg.embedded.entities import Attribute, Change, Entity, read_changes
from iveg.embedded.http_server import Request, Response
from iveg.embedded.ngsi_request import (
    Call,
    check_accept,
    check_body,
    check_size,
    names,
    paging,
    pattern,
    read_id,
    read_options,
    read_value,
    scope,
)
from iveg.embedded.orion_errors import (
    ATTRIBUTE_NOT_FOUND,
    NgsiError,
    bad_request,
    not_found,
)
from iveg.embedded.orion_text import looks_clean
from iveg.embedded.query import matches_query, ordered
from iveg.embedded.registrations import read_registration
from iveg.embedded.subscriptions import (
    Subscription,
    read_subscription,
    update_subscription,
)
from iveg.embedded.views import write_attributes, write_entity

_URLS = {
    "entities_url": "/v2/entities",
    "types_url": "/v2/types",
    "subscriptions_url": "/v2/subscriptions",
    "registrations_url": "/v2/registrations",
}
_ACTIONS = {"UPDATE": "update", "APPEND": "append", "DELETE": "delete",
            "APPEND_STRICT": "appendStrict", "REPLACE": "replace"}  # fmt: skip


_Route = Callable[["NgsiApi", Call], Awaitable[Response]]


class NgsiApi:
    """Answers the requests that Orion would.

    Args:
        broker: Keeps what is told.
        started: When it came up (s, Unix time).
    """

    def __init__(self, broker: ContextBroker, started: float) -> None:
        self._broker = broker
        self._started = started

    async def handle(self, request: Request) -> Response:
        """Answer one request."""
        correlator = request.headers.get("fiware-correlator", "")
        correlator = correlator or self._broker.outbox.correlator()
        try:
            response = await self._answer(request, correlator)
        except NgsiError as error:
            response = Response(error.status, error.body)
            if error.allow:
                response.headers["Allow"] = error.allow
            if request.headers.get("accept") == "text/plain":
                response = Response(
                    error.status, error.body, response.headers, "text/plain"
                )
        response.headers["Fiware-Correlator"] = correlator
        return response

    async def _answer(self, request: Request, correlator: str) -> Response:
        check_size(request)
        parts = tuple(part for part in request.path.split("/") if part)
        routes = _routes_of(parts)
        route = routes.get(request.method)
        if route is None:
            # Orion lists the methods of a path in the order of its own table.
            raise NgsiError(
                405, "MethodNotAllowed", "method not allowed", ", ".join(routes)
            )
        check_body(request)
        check_accept(request)
        whose = scope(request, correlator, clock.now().wall)
        options = read_options(request)
        return await route(self, Call(request, whose, options, parts[1:]))

    # --- the service itself -----------------------------------------------------

    async def version(self, call: Call) -> Response:
        """``GET /version``."""
        up = int(call.scope.now - self._started)
        uptime = f"{up // 86400} d, {up // 3600 % 24} h, {up // 60 % 60} m, {up % 60} s"
        about = {"version": "4.7.0-iveg-embedded", "uptime": uptime}
        return _json({"orion": about})

    async def urls(self, _: Call) -> Response:
        """``GET /v2``."""
        return _json(_URLS)

    # --- entities ---------------------------------------------------------------

    async def list_entities(self, call: Call) -> Response:
        """``GET /v2/entities``."""
        query = call.request.query
        limit, offset = paging(query)
        chosen = self._chosen(call)
        view = call.view()
        told = await self._told(call, "", view.names)
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
            if not view.names
            or _has_any(one, view.names)
            or told.get((one.id, one.type))
        ]
        response = _text(b"[%b]" % b",".join(shown[offset : offset + limit]))
        if "count" in call.options:
            response.headers["Fiware-Total-Count"] = str(len(shown))
        return response

    def _chosen(self, call: Call) -> list[Entity]:
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
            for one in self._broker.tenant(call.scope.service).entities.all(
                call.scope.path
            )
            if (not ids or one.id in ids)
            and (not kinds or one.type in kinds)
            and (id_pattern is None or id_pattern.search(one.id))
            and (kind_pattern is None or kind_pattern.search(one.type))
            and matches_query(one, query.get("q", ""))
        ]
        return ordered(found, query.get("orderBy", ""))

    async def create_entity(self, call: Call) -> Response:
        """``POST /v2/entities``."""
        raw = call.object()
        entity_id, kind = read_id(raw)
        changes = call.changes(raw)
        location = {"Location": f"/v2/entities/{entity_id}?type={kind}"}
        if "upsert" in call.options:
            known = self._broker.tenant(call.scope.service).entities.get(
                call.scope.path, entity_id, kind
            )
            self._broker.upsert(call.scope, entity_id, kind, changes)
            return Response(201 if known is None else 204, headers=location)
        self._broker.create(call.scope, entity_id, kind, changes)
        return Response(201, headers=location)

    async def get_entity(self, call: Call) -> Response:
        """``GET /v2/entities/{id}``."""
        entity, told = await self._whole(call)
        return _text(write_entity(entity, call.view(), told))

    async def get_attributes(self, call: Call) -> Response:
        """``GET /v2/entities/{id}/attrs``."""
        entity, told = await self._whole(call)
        return _text(write_attributes(entity, call.view(), told))

    async def _whole(self, call: Call) -> tuple[Entity, Mapping[str, Attribute]]:
        """One entity with what its providers tell of it."""
        entity_id, view = call.parts[1], call.view()
        entity = self._broker.tenant(call.scope.service).entities.find(
            call.scope.path, entity_id, call.kind
        )
        told = await self._told(call, entity_id, view.names)
        if entity is not None:
            return entity, told.get((entity.id, entity.type), {})
        if not told:
            raise not_found()
        key, attributes = next(iter(told.items()))
        return _ghost(call.scope, *key), attributes

    async def _told(
        self, call: Call, entity_id: str, names: tuple[str, ...]
    ) -> Mapping[tuple[str, str], Mapping[str, Attribute]]:
        if "skipForwarding" in call.options:
            return {}
        return await self._broker.foreign(call.scope, entity_id, call.kind, names)

    async def delete_entity(self, call: Call) -> Response:
        """``DELETE /v2/entities/{id}``."""
        entity = self._broker.find(call.scope, call.parts[1], call.kind)
        self._broker.delete(call.scope, entity)
        return Response(204)

    async def append_attributes(self, call: Call) -> Response:
        """``POST /v2/entities/{id}/attrs``."""
        changes = call.changes(call.object())
        entity = self._broker.find(call.scope, call.parts[1], call.kind)
        self._broker.append(
            call.scope,
            entity,
            changes,
            forced="forcedUpdate" in call.options,
            strict="append" in call.options,
        )
        return Response(204)

    async def update_attributes(self, call: Call) -> Response:
        """``PATCH /v2/entities/{id}/attrs``."""
        changes = call.changes(call.object())
        if not changes:
            raise bad_request("empty payload")
        await self._update(call, changes)
        return Response(204)

    async def replace_attributes(self, call: Call) -> Response:
        """``PUT /v2/entities/{id}/attrs``."""
        changes = call.changes(call.object())
        entity = self._broker.find(call.scope, call.parts[1], call.kind)
        self._broker.replace(call.scope, entity, changes)
        return Response(204)

    async def _update(self, call: Call, changes: Mapping[str, Change]) -> None:
        await self._broker.update(
            call.scope,
            call.parts[1],
            call.kind,
            changes,
            forced="forcedUpdate" in call.options,
        )

    # --- one attribute ----------------------------------------------------------

    async def get_attribute(self, call: Call) -> Response:
        """``GET /v2/entities/{id}/attrs/{name}``."""
        attribute = await self._attribute(call, self._id_of(call))
        return _text(attribute.normalized(call.view().metadata))

    async def get_value(self, call: Call) -> Response:
        """``GET /v2/entities/{id}/attrs/{name}/value``.

        Orion 4.3 to 4.7 takes the id for a pattern here, so that ``AGI`` is also
        ``AGI2``; a client must be able to meet that.
        """
        near = [
            one.id
            for one in self._broker.tenant(call.scope.service).entities.all(
                call.scope.path
            )
            if re.search(call.parts[1], one.id)
            and (not call.kind or one.type == call.kind)
        ]
        if len(near) > 1:
            raise NgsiError(
                409,
                "TooManyResults",
                "More than one matching entity. Please refine your query",
            )
        json = (await self._attribute(call, near[0] if near else call.parts[1])).json
        structured = json[:1] in b"[{"
        return Response(
            200, json, content_type="application/json" if structured else "text/plain"
        )

    def _id_of(self, call: Call) -> str:
        return call.parts[1]

    async def _attribute(self, call: Call, entity_id: str) -> Attribute:
        name = call.parts[3]
        entity = self._broker.tenant(call.scope.service).entities.find(
            call.scope.path, entity_id, call.kind
        )
        if entity is not None and name in entity.attributes:
            return entity.attributes[name]
        told = await self._told(call, entity_id, (name,))
        for attributes in told.values():
            if name in attributes:
                return attributes[name]
        raise not_found(ATTRIBUTE_NOT_FOUND) if entity is not None else not_found()

    async def put_attribute(self, call: Call) -> Response:
        """``PUT /v2/entities/{id}/attrs/{name}``."""
        await self._update(call, call.changes({call.parts[3]: call.json()}))
        return Response(204)

    async def put_value(self, call: Call) -> Response:
        """``PUT /v2/entities/{id}/attrs/{name}/value``."""
        value = read_value(call)
        changes = read_changes(
            {call.parts[3]: {"value": value}},
            key_values=False,
            clean=looks_clean(call.request.body.strip(b'"')),
        )
        await self._update(call, changes)
        return Response(204)

    async def delete_attribute(self, call: Call) -> Response:
        """``DELETE /v2/entities/{id}/attrs/{name}``."""
        entity = self._broker.find(call.scope, call.parts[1], call.kind)
        self._broker.delete_attributes(call.scope, entity, [call.parts[3]])
        return Response(204)

    # --- batches ----------------------------------------------------------------

    async def batch_update(self, call: Call) -> Response:
        """``POST /v2/op/update``."""
        raw = call.object()
        action = _ACTIONS.get(str(raw.get("actionType")), raw.get("actionType"))
        entities = raw.get("entities")
        if not isinstance(entities, list) or not entities:
            raise bad_request("empty update action payload")
        read = [(*read_id(one), call.changes(one)) for one in entities]
        if action == "update":
            await self._broker.update_many(call.scope, read)
        elif action in ("append", "appendStrict"):
            for entity_id, kind, changes in read:
                self._append_one(call, entity_id, kind, changes, action)
        elif action in ("replace", "delete"):
            for entity_id, kind, changes in read:
                entity = self._broker.find(call.scope, entity_id, kind)
                self._change_one(call, entity, changes, action)
        else:
            raise bad_request("invalid update action type")
        return Response(204)

    def _append_one(
        self,
        call: Call,
        entity_id: str,
        kind: str,
        changes: Mapping[str, Change],
        action: str,
    ) -> None:
        known = self._broker.tenant(call.scope.service).entities.get(
            call.scope.path, entity_id, kind
        )
        if known is None or action == "append":
            self._broker.upsert(call.scope, entity_id, kind, changes)
        else:
            self._broker.append(call.scope, known, changes, strict=True)

    def _change_one(
        self, call: Call, entity: Entity, changes: Mapping[str, Change], action: str
    ) -> None:
        if action == "replace":
            self._broker.replace(call.scope, entity, changes)
        elif changes:
            self._broker.delete_attributes(call.scope, entity, changes)
        else:
            self._broker.delete(call.scope, entity)

    # --- subscriptions ----------------------------------------------------------

    async def list_subscriptions(self, call: Call) -> Response:
        """``GET /v2/subscriptions``."""
        limit, offset = paging(call.request.query)
        known = self._broker.tenant(call.scope.service).subscriptions.values()
        shown = [one.show(call.scope.now) for one in known]
        response = _json(shown[offset : offset + limit])
        if "count" in call.options:
            response.headers["Fiware-Total-Count"] = str(len(shown))
        return response

    async def create_subscription(self, call: Call) -> Response:
        """``POST /v2/subscriptions``."""
        made = read_subscription(call.json(), call.scope.service, call.scope.path)
        self._broker.subscribe(made)
        return Response(201, headers={"Location": f"/v2/subscriptions/{made.id}"})

    async def get_subscription(self, call: Call) -> Response:
        """``GET /v2/subscriptions/{id}``."""
        return _json(self._subscription(call).show(call.scope.now))

    async def patch_subscription(self, call: Call) -> Response:
        """``PATCH /v2/subscriptions/{id}``."""
        known = self._subscription(call, "subscription id not found")
        update_subscription(known, call.json())
        self._broker.resubscribe(known)
        return Response(204)

    async def delete_subscription(self, call: Call) -> Response:
        """``DELETE /v2/subscriptions/{id}``."""
        self._broker.unsubscribe(self._subscription(call))
        return Response(204)

    def _subscription(
        self,
        call: Call,
        unknown: str = "The requested subscription has not been found. Check id",
    ) -> Subscription:
        wanted = call.parts[1]
        if len(wanted) != 24:
            raise bad_request("Invalid subscription ID: bad length - 24 chars expected")
        known = self._broker.tenant(call.scope.service).subscriptions.get(wanted)
        if known is None:
            raise not_found(unknown)
        return known

    # --- registrations ----------------------------------------------------------

    async def list_registrations(self, call: Call) -> Response:
        """``GET /v2/registrations``."""
        limit, offset = paging(call.request.query)
        known = self._broker.tenant(call.scope.service).registrations.values()
        shown = [one.show() for one in known]
        response = _json(shown[offset : offset + limit])
        if "count" in call.options:
            response.headers["Fiware-Total-Count"] = str(len(shown))
        return response

    async def create_registration(self, call: Call) -> Response:
        """``POST /v2/registrations``."""
        made = read_registration(call.json(), call.scope.path)
        self._broker.register(call.scope, made)
        return Response(201, headers={"Location": f"/v2/registrations/{made.id}"})

    async def get_registration(self, call: Call) -> Response:
        """``GET /v2/registrations/{id}``."""
        known = self._broker.tenant(call.scope.service).registrations
        if call.parts[1] not in known:
            raise not_found("The requested registration has not been found. Check id")
        return _json(known[call.parts[1]].show())

    async def delete_registration(self, call: Call) -> Response:
        """``DELETE /v2/registrations/{id}``."""
        if not self._broker.unregister(call.scope, call.parts[1]):
            raise not_found("The requested registration has not been found. Check id")
        return Response(204)


_TABLE: tuple[tuple[tuple[str, ...], dict[str, _Route]], ...] = (
    (("version",), {"GET": NgsiApi.version}),
    (("v2",), {"GET": NgsiApi.urls}),
    (
        ("v2", "entities"),
        {"POST": NgsiApi.create_entity, "GET": NgsiApi.list_entities},
    ),
    (
        ("v2", "entities", "*"),
        {"GET": NgsiApi.get_entity, "DELETE": NgsiApi.delete_entity},
    ),
    (
        ("v2", "entities", "*", "attrs"),
        {
            "GET": NgsiApi.get_attributes,
            "PUT": NgsiApi.replace_attributes,
            "POST": NgsiApi.append_attributes,
            "PATCH": NgsiApi.update_attributes,
        },
    ),
    (
        ("v2", "entities", "*", "attrs", "*"),
        {
            "GET": NgsiApi.get_attribute,
            "PUT": NgsiApi.put_attribute,
            "DELETE": NgsiApi.delete_attribute,
        },
    ),
    (
        ("v2", "entities", "*", "attrs", "*", "value"),
        {"GET": NgsiApi.get_value, "PUT": NgsiApi.put_value},
    ),
    (("v2", "op", "update"), {"POST": NgsiApi.batch_update}),
    (
        ("v2", "subscriptions"),
        {"POST": NgsiApi.create_subscription, "GET": NgsiApi.list_subscriptions},
    ),
    (
        ("v2", "subscriptions", "*"),
        {
            "GET": NgsiApi.get_subscription,
            "DELETE": NgsiApi.delete_subscription,
            "PATCH": NgsiApi.patch_subscription,
        },
    ),
    (
        ("v2", "registrations"),
        {"POST": NgsiApi.create_registration, "GET": NgsiApi.list_registrations},
    ),
    (
        ("v2", "registrations", "*"),
        {"GET": NgsiApi.get_registration, "DELETE": NgsiApi.delete_registration},
    ),
)


def _routes_of(parts: tuple[str, ...]) -> dict[str, _Route]:
    for shape, routes in _TABLE:
        if len(shape) == len(parts) and all(
            one in ("*", part) for one, part in zip(shape, parts, strict=True)
        ):
            return routes
    raise bad_request("Service not found. Check your URL as probably it is wrong.")


def _ghost(scope: Scope, entity_id: str, kind: str) -> Entity:
    """An entity that only a provider knows."""
    return Entity(entity_id, kind, scope.path, scope.now, scope.now)


def _has_any(entity: Entity, names: tuple[str, ...]) -> bool:
    return "*" in names or any(
        name in entity.attributes or name.startswith("date") for name in names
    )


def _json(value: Any) -> Response:
    return _text(orjson.dumps(value))


def _text(body: bytes) -> Response:
    return Response(200, body)
