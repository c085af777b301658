"""In-memory context broker that answers NGSI-v2 over HTTP as Orion 4.7 does.

It has the requests that iVeg makes; all others are refused with 501.  Its limits are
listed in ``docs/fiware.md``.  The embedded IoT Agent calls its operations directly.
"""

import asyncio
import re
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import orjson
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response

from iveg.adapters import clock
from iveg.lab.embedded.entities import (
    Attribute,
    Endpoint,
    Entity,
    EntityView,
    FiwareError,
    Scope,
    bad_request,
    check_name,
    check_value,
    fiware_app,
    load_object,
    looks_clean,
    new_id,
    not_found,
    not_supported,
    write_entity,
)
from iveg.lab.embedded.subscriptions import Subscription

PATIENCE_S = 5.0
Provider = Callable[[Scope, str, str, Mapping[str, object]], Awaitable[None]]
"""Carries out commands of an entity: its id, its type, and the values by name."""


@dataclass(frozen=True, slots=True)
class Registration:
    """Attributes of one entity that another context provider has: its commands.

    Attributes:
        path: Service path.
        url: Address of the provider.
        provider: The provider itself, which is in this process.
    """

    id: str
    path: str
    entity_id: str
    entity_type: str
    attrs: tuple[str, ...]
    url: str
    provider: Provider

    def provides(self, path: str, entity_id: str, kind: str, name: str) -> bool:
        """Whether an attribute of an entity is among them."""
        own_keys = self.path, self.entity_id, self.entity_type
        return own_keys == (path, entity_id, kind) and name in self.attrs

    def show(self) -> dict[str, Any]:
        """The registration as a client gets it."""
        entity = {"id": self.entity_id, "type": self.entity_type}
        return {
            "id": self.id,
            "dataProvided": {"entities": [entity], "attrs": self.attrs},
            "provider": {
                "http": {"url": self.url},
                "supportedForwardingMode": "all",
                "legacyForwarding": False,
            },
            "status": "active",
        }


@dataclass(slots=True)
class Tenant:
    """All data of one tenant, oldest first."""

    entities: dict[tuple[str, str, str], Entity] = field(default_factory=dict)
    subscriptions: dict[str, Subscription] = field(default_factory=dict)
    registrations: dict[str, Registration] = field(default_factory=dict)


class ContextBroker:
    """Entities, subscriptions and registrations of all tenants."""

    def __init__(self) -> None:
        self._tenants: dict[str, Tenant] = {}
        self._passing: set[asyncio.Future[None]] = set()

    def tenant(self, service: str) -> Tenant:
        """The data of a tenant; empty for an unknown one."""
        return self._tenants.setdefault(service, Tenant())

    def close(self) -> None:
        """Close the connections to receivers; forget commands under way."""
        for tenant in self._tenants.values():
            for subscription in tenant.subscriptions.values():
                subscription.close()
        for passing in self._passing:
            passing.cancel()

    # --- entities ---------------------------------------------------------------

    def known(self, scope: Scope, entity_id: str, kind: str) -> Entity | None:
        """The oldest entity of an id and a type, which may be empty."""
        entities = self.tenant(scope.service).entities
        if kind:
            return entities.get((scope.path, entity_id, kind))
        place = (scope.path, entity_id)
        return next((entities[key] for key in entities if key[:2] == place), None)

    def find(self, scope: Scope, entity_id: str, kind: str) -> Entity:
        """Find the entity of an id and a type, which may be empty.

        Raises:
            FiwareError: 404, there is none.
        """
        entity = self.known(scope, entity_id, kind)
        if entity is None:
            raise not_found()
        return entity

    def upsert(
        self, scope: Scope, entity_id: str, kind: str, changes: Mapping[str, Attribute]
    ) -> None:
        """Create an entity, or add to and change its attributes; notify."""
        entity = Entity(entity_id, kind, scope.path)
        entities = self.tenant(scope.service).entities
        self.append(scope, entities.setdefault(entity.key, entity), changes)

    def append(
        self, scope: Scope, entity: Entity, changes: Mapping[str, Attribute]
    ) -> None:
        """Change attributes; create the missing ones; notify."""
        now = clock.wall()
        changed = entity.apply(changes, now)
        for subscription in self.tenant(scope.service).subscriptions.values():
            if subscription.wants(entity, changed, now):
                subscription.notify(entity, now)

    # --- updates that may go to a provider --------------------------------------

    async def update(
        self, scope: Scope, entity_id: str, kind: str, changes: Mapping[str, Attribute]
    ) -> None:
        """Change existing attributes; pass registered ones on to their providers.

        An attribute that is here is never passed on.

        Raises:
            FiwareError: 404, no such entity, or its provider is silent; 422, no such
                attribute.  The possible part is done.
        """
        entity = self.known(scope, entity_id, kind)
        kind = entity.type if entity else kind
        attributes = entity.attributes if entity else {}
        local = {name: change for name, change in changes.items() if name in attributes}
        if entity is not None and local:
            self.append(scope, entity, local)
        unknown = []
        for name in changes.keys() - local.keys():
            for registration in self.tenant(scope.service).registrations.values():
                if registration.provides(scope.path, entity_id, kind, name):
                    await self._pass_on(
                        registration, scope, {name: changes[name].value}
                    )
                    break
            else:
                unknown.append(name)
        if unknown and entity is None:
            raise not_found()
        if unknown:
            sentence = f"do not exist: {entity_id} - [ {', '.join(unknown)} ]"
            raise FiwareError("Unprocessable", sentence)

    async def _pass_on(
        self, registration: Registration, scope: Scope, values: Mapping[str, object]
    ) -> None:
        """Let a provider do its part; after the time limit it may still go on.

        Raises:
            FiwareError: 404, it is silent or refuses.
        """
        entity = registration.entity_id, registration.entity_type
        passing = asyncio.ensure_future(registration.provider(scope, *entity, values))
        self._passing.add(passing)
        passing.add_done_callback(self._passing.discard)
        finished, _ = await asyncio.wait({passing}, timeout=PATIENCE_S)
        if not finished or passing.exception() is not None:
            raise not_found()


_OPTIONS = {"keyValues", "count", "upsert", "skipForwarding"}
_PARAMETERS = {
    "id", "type", "attrs", "metadata", "orderBy", "options", "limit", "offset",
}  # fmt: skip
_MAX_BODY = 1 << 20
_SERVICE = re.compile(r"[a-z0-9_]{0,50}")
_PATH = re.compile(r"/|(/[A-Za-z0-9_]{1,50}){1,10}")


class _Call:
    """One request with its parameters, scope and body.

    Raises:
        FiwareError: 400, 413 or 501.
    """

    def __init__(self, request: Request, body: bytes, broker: ContextBroker) -> None:
        self.query, self.body, self.broker = request.query_params, body, broker
        self.place = request.path_params
        self.name = str(self.place.get("id", ""))
        self.kind = self.query.get("type", "")
        self.options = set(_split(self.query.get("options")))
        if len(body) > _MAX_BODY:
            raise FiwareError(
                "RequestEntityTooLarge",
                f"payload size: {len(body)}, max size supported: {_MAX_BODY}",
            )
        unknown = (self.options - _OPTIONS) | (self.query.keys() - _PARAMETERS)
        if unknown:
            raise not_supported(f"parameter or option {min(unknown)}")
        service = request.headers.get("fiware-service", "").lower()
        if _SERVICE.fullmatch(service) is None:
            raise bad_request(
                "bad character in tenant name - only underscore and alphanumeric "
                "characters are allowed"
            )
        path = request.headers.get("fiware-servicepath", "/")
        if _PATH.fullmatch(path) is None:
            raise bad_request("Bad Character in Service-Path")
        self.scope = Scope(service, path)
        self.tenant = broker.tenant(service)

    def changes(self, raw: Mapping[str, Any]) -> dict[str, Attribute]:
        """Read attributes of the body.

        Raises:
            FiwareError: 400 or 501.
        """
        clean = looks_clean(self.body)
        changes = {}
        for name, attribute in raw.items():
            check_name(name, "attribute name")
            if not isinstance(attribute, dict):
                raise bad_request("attribute must be a JSON object")
            if attribute.keys() != {"type", "value"}:
                raise not_supported("an attribute but with its type and value")
            kind = check_name(attribute["type"], "attribute type")
            check_value(attribute["value"], clean=clean)
            changes[name] = Attribute(kind, attribute["value"])
        return changes

    def view(self) -> EntityView:
        """The requested representation."""
        dated = self.query.get("metadata", "")
        if dated not in ("", "dateModified"):
            raise not_supported("metadata other than dateModified")
        names = _split(self.query.get("attrs"))
        return EntityView(names, "keyValues" in self.options, bool(dated))

    def page(self, items: Iterable[bytes]) -> Response:
        """The requested part of a list of JSON texts.

        Raises:
            FiwareError: 400, no such page.
        """
        limit, offset = self._number("limit", "20"), self._number("offset", "0")
        if limit > 1000:
            raise bad_request(f"Bad pagination limit: /{limit}/ [max: 1000]")
        texts = list(items)
        body = b"[%b]" % b",".join(texts[offset : offset + limit])
        return _json(body, {"Fiware-Total-Count": str(len(texts))})

    def _number(self, name: str, default: str) -> int:
        text = self.query.get(name, default)
        if not text.isdecimal():
            raise bad_request(f"Bad pagination {name}: /{text}/")
        return int(text)


_Answer = Callable[[_Call], Awaitable[Response]]


def _split(text: str | None) -> tuple[str, ...]:
    """A comma-separated list."""
    return tuple(name for name in (text or "").split(",") if name)


def ngsi_api(broker: ContextBroker) -> Starlette:
    """The HTTP side of a context broker, which answers requests as Orion does."""

    def endpoint(answer: _Answer) -> Endpoint:
        async def respond(request: Request) -> Response:
            return await answer(_Call(request, await request.body(), broker))

        return respond

    table = {line: endpoint(answer) for line, answer in _ANSWERS.items()}
    return fiware_app(table, "error", "description")


def _json(body: bytes, headers: Mapping[str, str] | None = None) -> Response:
    return Response(body, 200, headers, "application/json")


async def _version(_: _Call) -> Response:
    return _json(b'{"orion":{"version":"4.7.0-iveg-embedded"}}')


# --- entities -------------------------------------------------------------------


async def _create_entity(call: _Call) -> Response:
    raw = load_object(call.body)
    entity_id = check_name(raw.pop("id", ""), "entity id")
    kind = check_name(raw.pop("type", ""), "entity type")
    changes = call.changes(raw)
    is_known = (call.scope.path, entity_id, kind) in call.tenant.entities
    if is_known and "upsert" not in call.options:
        raise FiwareError("Unprocessable", "Already Exists")
    call.broker.upsert(call.scope, entity_id, kind, changes)
    location = {"Location": f"/v2/entities/{entity_id}?type={kind}"}
    return Response(status_code=204 if is_known else 201, headers=location)


async def _list_entities(call: _Call) -> Response:
    """List entities; one without a requested attribute is listed without it."""
    ids, kinds = _split(call.query.get("id")), _split(call.kind)
    if call.query.get("orderBy", "id") != "id":
        raise not_supported("orderBy other than id")
    entities = [
        entity
        for entity in call.tenant.entities.values()
        if entity.path == call.scope.path
        and (not ids or entity.id in ids)
        and (not kinds or entity.type in kinds)
    ]
    view = call.view()
    if "orderBy" in call.query:
        entities.sort(key=lambda entity: entity.id)
    return call.page(write_entity(entity, view) for entity in entities)


async def _get_entity(call: _Call) -> Response:
    entity = call.broker.find(call.scope, call.name, call.kind)
    return _json(write_entity(entity, call.view()))


async def _delete_entity(call: _Call) -> Response:
    """Delete an entity; nobody is notified."""
    del call.tenant.entities[call.broker.find(call.scope, call.name, call.kind).key]
    return Response(status_code=204)


async def _update_attributes(call: _Call) -> Response:
    changes = call.changes(load_object(call.body))
    await call.broker.update(call.scope, call.name, call.kind, changes)
    return Response(status_code=204)


async def _delete_attribute(call: _Call) -> Response:
    """Delete an attribute; nobody is notified."""
    entity = call.broker.find(call.scope, call.name, call.kind)
    if entity.attributes.pop(call.place["name"], None) is None:
        raise not_found("The entity does not have such an attribute")
    return Response(status_code=204)


# --- subscriptions and registrations --------------------------------------------


async def _list_subscriptions(call: _Call) -> Response:
    known = call.tenant.subscriptions.values()
    return call.page(orjson.dumps(subscription.show()) for subscription in known)


async def _create_subscription(call: _Call) -> Response:
    scope, raw = call.scope, load_object(call.body)
    made = Subscription(new_id(), raw, scope.service, scope.path)
    call.tenant.subscriptions[made.id] = made
    location = {"Location": f"/v2/subscriptions/{made.id}"}
    return Response(status_code=201, headers=location)


async def _change_subscription(call: _Call) -> Response:
    _subscription(call).change(load_object(call.body))
    return Response(status_code=204)


async def _delete_subscription(call: _Call) -> Response:
    subscription = _subscription(call)
    subscription.close()
    del call.tenant.subscriptions[subscription.id]
    return Response(status_code=204)


def _subscription(call: _Call) -> Subscription:
    known = call.tenant.subscriptions.get(call.name)
    if known is None:
        raise not_found("The requested subscription has not been found. Check id")
    return known


async def _list_registrations(call: _Call) -> Response:
    known = call.tenant.registrations.values()
    return call.page(orjson.dumps(registration.show()) for registration in known)


async def _delete_registration(call: _Call) -> Response:
    if call.tenant.registrations.pop(call.name, None) is None:
        raise not_found("The requested registration has not been found. Check id")
    return Response(status_code=204)


_ANSWERS: dict[str, _Answer] = {
    "GET /version": _version,
    "POST /v2/entities": _create_entity,
    "GET /v2/entities": _list_entities,
    "GET /v2/entities/{id}": _get_entity,
    "DELETE /v2/entities/{id}": _delete_entity,
    "PATCH /v2/entities/{id}/attrs": _update_attributes,
    "DELETE /v2/entities/{id}/attrs/{name}": _delete_attribute,
    "POST /v2/subscriptions": _create_subscription,
    "GET /v2/subscriptions": _list_subscriptions,
    "PATCH /v2/subscriptions/{id}": _change_subscription,
    "DELETE /v2/subscriptions/{id}": _delete_subscription,
    "GET /v2/registrations": _list_registrations,
    "DELETE /v2/registrations/{id}": _delete_registration,
}
