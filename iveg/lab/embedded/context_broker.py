"""In-memory context broker that answers NGSI-v2 over HTTP as Orion 4.7 does.

Only what iVeg asks for; all else is refused with 501.  Its limits are listed in
``docs/fiware.md``.  The embedded IoT Agent calls its operations directly.
"""

import asyncio
import re
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field

import orjson
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response

from iveg.adapters import clock
from iveg.lab.embedded.entities import (
    Endpoint,
    Entity,
    EntityChange,
    EntityView,
    FiwareError,
    Scope,
    apply,
    bad_request,
    check_name,
    check_value,
    fiware_app,
    load_object,
    looks_clean,
    not_found,
    not_supported,
    write_entity,
)
from iveg.lab.embedded.subscriptions import Outbox, Subscription, read_subscription

PATIENCE_S = 5.0
_MOST_CONCERNED = 10_000
Provider = Callable[[Scope, str, str, Mapping[str, object]], Awaitable[None]]
"""Carries out commands of an entity: its id, its type, and the values by name."""


@dataclass(frozen=True, slots=True)
class Registration:
    """Attributes of one entity that another context provider has: its commands.

    Attributes:
        path: Service path.
        url: Address of the provider.
    """

    id: str
    path: str
    entity_id: str
    entity_type: str
    attrs: tuple[str, ...]
    url: str

    def show(self) -> dict[str, object]:
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
    _concerned: dict[object, tuple[Subscription, ...]] = field(default_factory=dict)
    """By entity and attributes; cleared at every change of a subscription."""

    def concerned(
        self, entity: Entity, names: tuple[str, ...]
    ) -> tuple[Subscription, ...]:
        """Subscriptions that a change of these attributes may concern."""
        known = self._concerned.get(key := (entity.key, names))
        if known is None:
            if len(self._concerned) >= _MOST_CONCERNED:
                self._concerned.clear()
            known = self._concerned[key] = tuple(
                one
                for one in self.subscriptions.values()
                if one.concerns(entity) and one.may_want(names)
            )
        return known

    def forget_concerned(self) -> None:
        """Clear the cache after a change of the subscriptions."""
        self._concerned.clear()

    def registration(
        self, scope: Scope, entity_id: str, kind: str, name: str
    ) -> Registration | None:
        """The oldest registration of an attribute of an entity."""
        wanted = (scope.path, entity_id, kind)
        for one in self.registrations.values():
            if name in one.attrs and (
                wanted == (one.path, one.entity_id, one.entity_type)
            ):
                return one
        return None


class ContextBroker:
    """Entities, subscriptions and registrations of all tenants.

    Attributes:
        providers: Context providers of this process, by address.
    """

    def __init__(self) -> None:
        self._tenants: dict[str, Tenant] = {}
        self.outbox = Outbox(clock.wall)
        self.providers: dict[str, Provider] = {}
        self._passing: set[asyncio.Future[None]] = set()

    def tenant(self, service: str) -> Tenant:
        """The data of a tenant; empty for an unknown one."""
        known = self._tenants.get(service)
        if known is None:
            known = self._tenants[service] = Tenant()
        return known

    def close(self) -> None:
        """Close the connections to receivers; forget commands under way."""
        self.outbox.close()
        for one in self._passing:
            one.cancel()

    # --- entities ---------------------------------------------------------------

    def known(self, scope: Scope, entity_id: str, kind: str) -> Entity | None:
        """The entity of an id and a type, which may be empty, if there is one.

        Raises:
            FiwareError: 409 several.
        """
        entities = self.tenant(scope.service).entities
        if kind:
            return entities.get((scope.path, entity_id, kind))
        found = [
            one
            for one in entities.values()
            if (one.path, one.id) == (scope.path, entity_id)
        ]
        if len(found) > 1:
            raise FiwareError(
                "TooManyResults",
                "More than one matching entity. Please refine your query",
            )
        return found[0] if found else None

    def find(self, scope: Scope, entity_id: str, kind: str) -> Entity:
        """Find the entity of an id and a type, which may be empty.

        Raises:
            FiwareError: 404 none, 409 several.
        """
        found = self.known(scope, entity_id, kind)
        if found is None:
            raise not_found()
        return found

    def upsert(
        self,
        scope: Scope,
        entity_id: str,
        kind: str,
        changes: Mapping[str, EntityChange],
    ) -> None:
        """Create an entity, or add to and change its attributes; notify."""
        entities = self.tenant(scope.service).entities
        entity = entities.get((scope.path, entity_id, kind))
        if entity is None:
            entity = Entity(entity_id, kind, scope.path, scope.now, scope.now)
            entities[entity.key] = entity
        self.append(scope, entity, changes)

    def append(
        self, scope: Scope, entity: Entity, changes: Mapping[str, EntityChange]
    ) -> None:
        """Change attributes; create the missing ones; notify."""
        touched = apply(entity, changes, scope.now)
        for subscription in self.tenant(scope.service).concerned(
            entity, tuple(touched.now)
        ):
            if subscription.wants(touched, scope.now):
                self.outbox.post(subscription, entity, scope.now)

    def delete(self, scope: Scope, entity: Entity) -> None:
        """Delete an entity, of which nobody is notified."""
        del self.tenant(scope.service).entities[entity.key]

    # --- updates that may have to be passed on ----------------------------------

    async def update(
        self,
        scope: Scope,
        entity_id: str,
        kind: str,
        changes: Mapping[str, EntityChange],
    ) -> None:
        """Change existing attributes; pass registered ones on to their providers.

        An attribute that is here is never passed on.

        Raises:
            FiwareError: 404, no such entity, or its provider is away; 422, no such
                attribute.  The possible part is done.
        """
        entity = self.known(scope, entity_id, kind)
        kind = entity.type if entity else kind
        own = entity.attributes if entity else {}
        local = {name: change for name, change in changes.items() if name in own}
        if entity is not None and local:
            self.append(scope, entity, local)
        missing = []
        for name, change in changes.items():
            if name not in local:
                registration = self.tenant(scope.service).registration(
                    scope, entity_id, kind, name
                )
                if registration is None:
                    missing.append(name)
                else:
                    await self._pass_on(registration, scope, {name: change.value})
        if missing and entity is None:
            raise not_found()
        if missing:
            raise FiwareError(
                "PartialUpdate" if local else "Unprocessable",
                f"do not exist: {entity_id} - [ {', '.join(missing)} ]",
            )

    async def _pass_on(
        self, registration: Registration, scope: Scope, values: Mapping[str, object]
    ) -> None:
        """Let a provider do its part; it may go on after it was given up.

        Raises:
            FiwareError: 404, it is away, silent or refuses.
        """
        provider = self.providers.get(registration.url)
        if provider is None:
            raise not_found()
        about = registration.entity_id, registration.entity_type
        passing = asyncio.ensure_future(provider(scope, *about, values))
        self._passing.add(passing)
        passing.add_done_callback(self._passing.discard)
        done, _ = await asyncio.wait({passing}, timeout=PATIENCE_S)
        if not done:
            raise not_found()
        try:
            passing.result()
        except FiwareError:
            raise not_found() from None

    # --- subscriptions ----------------------------------------------------------

    def subscribe(self, subscription: Subscription) -> None:
        """Store a subscription; it is notified of later changes."""
        tenant = self.tenant(subscription.service)
        tenant.subscriptions[subscription.id] = subscription
        tenant.forget_concerned()

    def unsubscribe(self, subscription: Subscription) -> None:
        """Delete a subscription and close its connection."""
        tenant = self.tenant(subscription.service)
        del tenant.subscriptions[subscription.id]
        tenant.forget_concerned()
        self.outbox.forget(subscription.id)


_OPTIONS = {"keyValues", "count", "upsert", "skipForwarding"}
_PARAMETERS = {
    "id", "type", "attrs", "metadata", "orderBy", "options", "limit", "offset",
}  # fmt: skip
_MAX_BODY = 1 << 20
_SERVICE = re.compile(r"[a-z0-9_]{0,50}")
_PATH = re.compile(r"/|(/[A-Za-z0-9_]{1,50}){1,10}")


@dataclass(frozen=True, slots=True)
class _Call:
    """One request.

    Attributes:
        body: What came with it.
        options: ``?options=``.
    """

    request: Request
    body: bytes
    broker: ContextBroker
    scope: Scope
    options: frozenset[str]

    @property
    def name(self) -> str:
        """Id of the entity, subscription or registration in the path."""
        return str(self.request.path_params["id"])

    @property
    def kind(self) -> str:
        """``?type=``."""
        return self.request.query_params.get("type", "")

    @property
    def tenant(self) -> Tenant:
        """The data of its tenant."""
        return self.broker.tenant(self.scope.service)

    def read_object(self) -> dict[str, object]:
        """The body, which must be an object.

        Raises:
            FiwareError: 400.
        """
        return load_object(self.body)

    def changes(self, raw: Mapping[str, object]) -> dict[str, EntityChange]:
        """Read attributes of the body.

        Raises:
            FiwareError: 400 or 501.
        """
        clean = looks_clean(self.body)
        return {
            check_name(name, "attribute name"): _read_change(one, clean=clean)
            for name, one in raw.items()
        }

    def view(self) -> EntityView:
        """The requested representation."""
        dated = self.request.query_params.get("metadata", "")
        if dated not in ("", "dateModified"):
            raise not_supported("metadata other than dateModified")
        names = _split(self.request.query_params.get("attrs"))
        return EntityView(names, "keyValues" in self.options, bool(dated))

    def page(self, shown: list[bytes]) -> Response:
        """The requested part of a list of JSON texts.

        Raises:
            FiwareError: 400, no such page.
        """
        limit, offset = self._number("limit", "20"), self._number("offset", "0")
        if limit > 1000:
            raise bad_request(f"Bad pagination limit: /{limit}/ [max: 1000]")
        body = b"[%b]" % b",".join(shown[offset : offset + limit])
        counted = {"Fiware-Total-Count": str(len(shown))}
        return _json(body, headers=counted if "count" in self.options else None)

    def _number(self, name: str, default: str) -> int:
        text = self.request.query_params.get(name, default)
        if not text.isdecimal():
            raise bad_request(f"Bad pagination {name}: /{text}/")
        return int(text)


_Answer = Callable[[_Call], Awaitable[Response]]


def _read_change(raw: object, *, clean: bool) -> EntityChange:
    if not isinstance(raw, dict):
        raise bad_request("attribute must be a JSON object")
    if not raw.keys() <= {"type", "value"}:
        raise not_supported("more of an attribute than its type and value")
    kind, value = raw.get("type"), raw.get("value")
    if kind is not None:
        check_name(kind, "attribute type")
    check_value(value, clean=clean)
    return EntityChange(kind, value)


def _split(text: str | None) -> tuple[str, ...]:
    """A comma-separated list."""
    return tuple(name for name in (text or "").split(",") if name)


def ngsi_api(broker: ContextBroker) -> Starlette:
    """The HTTP side of a context broker, which answers requests as Orion does."""

    def endpoint(answer: _Answer) -> Endpoint:
        async def respond(request: Request) -> Response:
            return await answer(await _read(request, broker))

        return respond

    table = {line: endpoint(answer) for line, answer in _ANSWERS.items()}
    return fiware_app(table, _refusal)


def _refusal(error: FiwareError) -> Response:
    return _json(error.body("error", "description"), error.status)


def _json(
    body: bytes, status: int = 200, headers: Mapping[str, str] | None = None
) -> Response:
    return Response(body, status, headers, "application/json")


async def _read(request: Request, broker: ContextBroker) -> _Call:
    """A request with its body, tenant, path and options.

    Raises:
        FiwareError: 400, 413 or 501.
    """
    body = await request.body()
    if len(body) > _MAX_BODY:
        raise FiwareError(
            "RequestEntityTooLarge",
            f"payload size: {len(body)}, max size supported: {_MAX_BODY}",
        )
    options = frozenset(_split(request.query_params.get("options")))
    for name in sorted(options - _OPTIONS):
        raise not_supported(f"options={name}")
    for name in sorted(request.query_params.keys() - _PARAMETERS):
        raise not_supported(f"parameter {name}")
    return _Call(request, body, broker, _read_scope(request), options)


def _read_scope(request: Request) -> Scope:
    service = request.headers.get("fiware-service", "").lower()
    if _SERVICE.fullmatch(service) is None:
        raise bad_request(
            "bad character in tenant name - only underscore and alphanumeric "
            "characters are allowed"
        )
    path = request.headers.get("fiware-servicepath", "/")
    if _PATH.fullmatch(path) is None:
        raise bad_request("Bad Character in Service-Path")
    return Scope(service, path, clock.wall())


async def _version(_: _Call) -> Response:
    about = {"version": "4.7.0-iveg-embedded"}
    return _json(orjson.dumps({"orion": about}))


# --- entities -------------------------------------------------------------------


async def _create_entity(call: _Call) -> Response:
    raw = call.read_object()
    entity_id = check_name(raw.pop("id", ""), "entity id")
    kind = check_name(raw.pop("type", "Thing"), "entity type")
    changes = call.changes(raw)
    known = (call.scope.path, entity_id, kind) in call.tenant.entities
    if known and "upsert" not in call.options:
        raise FiwareError("Unprocessable", "Already Exists")
    call.broker.upsert(call.scope, entity_id, kind, changes)
    location = {"Location": f"/v2/entities/{entity_id}?type={kind}"}
    return Response(status_code=204 if known else 201, headers=location)


async def _list_entities(call: _Call) -> Response:
    """An entity without a requested attribute is listed without it."""
    query = call.request.query_params
    ids, kinds, order = _split(query.get("id")), _split(call.kind), query.get("orderBy")
    if order not in (None, "id"):
        raise not_supported("orderBy other than id")
    found = [
        one
        for one in call.tenant.entities.values()
        if one.path == call.scope.path
        and (not ids or one.id in ids)
        and (not kinds or one.type in kinds)
    ]
    if order:
        found.sort(key=lambda one: one.id)
    view = call.view()
    return call.page([write_entity(one, view) for one in found])


async def _get_entity(call: _Call) -> Response:
    entity = call.broker.find(call.scope, call.name, call.kind)
    return _json(write_entity(entity, call.view()))


async def _delete_entity(call: _Call) -> Response:
    entity = call.broker.find(call.scope, call.name, call.kind)
    call.broker.delete(call.scope, entity)
    return Response(status_code=204)


async def _update_attributes(call: _Call) -> Response:
    changes = call.changes(call.read_object())
    await call.broker.update(call.scope, call.name, call.kind, changes)
    return Response(status_code=204)


async def _delete_attribute(call: _Call) -> Response:
    """Nobody is notified."""
    entity = call.broker.find(call.scope, call.name, call.kind)
    if entity.attributes.pop(call.request.path_params["name"], None) is None:
        raise not_found("The entity does not have such an attribute")
    return Response(status_code=204)


# --- subscriptions and registrations --------------------------------------------


async def _list_subscriptions(call: _Call) -> Response:
    known = call.tenant.subscriptions.values()
    return call.page(_printed(one.show(call.scope.now) for one in known))


async def _create_subscription(call: _Call) -> Response:
    made = read_subscription(call.read_object(), call.scope.service, call.scope.path)
    call.broker.subscribe(made)
    return Response(
        status_code=201, headers={"Location": f"/v2/subscriptions/{made.id}"}
    )


async def _change_subscription(call: _Call) -> Response:
    _subscription(call).change(call.read_object())
    call.tenant.forget_concerned()
    return Response(status_code=204)


async def _delete_subscription(call: _Call) -> Response:
    call.broker.unsubscribe(_subscription(call))
    return Response(status_code=204)


def _subscription(call: _Call) -> Subscription:
    known = call.tenant.subscriptions.get(call.name)
    if known is None:
        raise not_found("The requested subscription has not been found. Check id")
    return known


async def _list_registrations(call: _Call) -> Response:
    known = call.tenant.registrations.values()
    return call.page(_printed(one.show() for one in known))


async def _delete_registration(call: _Call) -> Response:
    if call.tenant.registrations.pop(call.name, None) is None:
        raise not_found("The requested registration has not been found. Check id")
    return Response(status_code=204)


def _printed(shown: Iterable[dict[str, object]]) -> list[bytes]:
    return [orjson.dumps(one) for one in shown]


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
