"""An in-memory context broker that implements NGSI-v2 as Orion 4.7 does.

Its limits are listed in ``docs/fiware.md``.  HTTP is in ``ngsi_api``; this module has
the operations, which the embedded IoT Agent also calls directly.
"""

import asyncio
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from iveg.adapters import clock
from iveg.lab.embedded.entities import (
    Entity,
    EntityChange,
    EntityStore,
    Touched,
    apply,
    under,
)
from iveg.lab.embedded.orion_text import NgsiError, not_found
from iveg.lab.embedded.outbox import Outbox
from iveg.lab.embedded.outcomes import Outcome
from iveg.lab.embedded.registrations import Registration, forward_update, providers
from iveg.lab.embedded.scope import Scope
from iveg.lab.embedded.subscriptions import Subscription

_MOST_CONCERNED = 10_000


@dataclass(slots=True)
class Tenant:
    """All data of one tenant."""

    entities: EntityStore = field(default_factory=EntityStore)
    subscriptions: dict[str, Subscription] = field(default_factory=dict)
    registrations: dict[str, Registration] = field(default_factory=dict)
    _concerned: dict[object, tuple[Subscription, ...]] = field(default_factory=dict)
    """By entity and attributes; cleared at every change of a subscription."""

    def concerned(
        self, entity: Entity, names: tuple[str, ...] | None
    ) -> tuple[Subscription, ...]:
        """Subscriptions that a change of an entity may concern.

        Args:
            entity: The entity.
            names: Attributes that were named; None for a deleted entity.
        """
        known = self._concerned.get(key := (entity.key, names))
        if known is None:
            if len(self._concerned) >= _MOST_CONCERNED:
                self._concerned.clear()
            known = self._concerned[key] = tuple(
                one
                for one in self.subscriptions.values()
                if one.concerns(entity.id, entity.type)
                and under(one.path, entity.path)
                and (names is None or one.may_want(names))
            )
        return known

    def forget_concerned(self) -> None:
        """Clear the cache after a change of the subscriptions."""
        self._concerned.clear()


class ContextBroker:
    """Entities, subscriptions and registrations of all tenants.

    Args:
        started: Start time (s, Unix time).
    """

    def __init__(self, started: float) -> None:
        self.started = started
        self._tenants: dict[str, Tenant] = {}
        self.outbox = Outbox(clock.wall)

    def tenant(self, service: str) -> Tenant:
        """The data of a tenant; empty for an unknown one."""
        known = self._tenants.get(service)
        if known is None:
            known = self._tenants[service] = Tenant()
        return known

    def close(self) -> None:
        """Close the connections to receivers."""
        self.outbox.close()

    # --- entities ---------------------------------------------------------------

    def known(
        self, scope: Scope, entity_id: str, entity_type: str = ""
    ) -> Entity | None:
        """The entity of an id and an optional type, if there is one.

        Raises:
            NgsiError: 409 several.
        """
        entities = self.tenant(scope.service).entities
        return entities.find(scope.path, entity_id, entity_type)

    def find(self, scope: Scope, entity_id: str, entity_type: str = "") -> Entity:
        """Find the entity of an id and an optional type.

        Raises:
            NgsiError: 404 none, 409 several.
        """
        found = self.known(scope, entity_id, entity_type)
        if found is None:
            raise not_found()
        return found

    def create(
        self,
        scope: Scope,
        entity_id: str,
        entity_type: str,
        changes: Mapping[str, EntityChange],
    ) -> Entity:
        """Create an entity and notify its subscriptions.

        Raises:
            NgsiError: 422, the entity exists already.
        """
        entities = self.tenant(scope.service).entities
        if entities.get(scope.path, entity_id, entity_type) is not None:
            raise NgsiError(422, "Unprocessable", "Already Exists")
        entity = Entity(entity_id, entity_type, scope.path, scope.now, scope.now)
        touched = apply(entity, changes, scope.now)
        entities.add(entity)
        self._tell(scope, entity, touched, "entityCreate")
        return entity

    def upsert(
        self,
        scope: Scope,
        entity_id: str,
        entity_type: str,
        changes: Mapping[str, EntityChange],
    ) -> None:
        """Create an entity, or add to and change its attributes."""
        entity = self.tenant(scope.service).entities.get(
            scope.path, entity_id, entity_type
        )
        if entity is None:
            self.create(scope, entity_id, entity_type, changes)
        else:
            self.append(scope, entity, changes)

    def append(
        self,
        scope: Scope,
        entity: Entity,
        changes: Mapping[str, EntityChange],
        *,
        forced: bool = False,
    ) -> None:
        """Change attributes; create the missing ones."""
        if changes:
            touched = apply(entity, changes, scope.now, forced=forced)
            self._tell(scope, entity, touched, "entityChange")

    def append_new(
        self,
        scope: Scope,
        entity: Entity,
        changes: Mapping[str, EntityChange],
        kind: str,
    ) -> Outcome:
        """Create attributes; existing ones stay unchanged.

        Args:
            scope: Whose data.
            entity: The entity.
            changes: The attributes.
            kind: The entity's type, as the request named it.
        """
        there = tuple(name for name in changes if name in entity.attributes)
        made = {name: one for name, one in changes.items() if name not in there}
        self.append(scope, entity, made)
        return Outcome(
            entity.id,
            kind,
            entity.type,
            exists=True,
            updated=tuple(made),
            refused=there,
        )

    def replace(
        self, scope: Scope, entity: Entity, changes: Mapping[str, EntityChange]
    ) -> None:
        """Replace all attributes."""
        entity.attributes = {}
        entity.modified = scope.now
        self.append(scope, entity, changes)

    def delete(self, scope: Scope, entity: Entity) -> None:
        """Delete an entity and notify its subscriptions."""
        tenant = self.tenant(scope.service)
        tenant.entities.remove(entity)
        self._tell(scope, entity, Touched(entity.attributes, all=True), "entityDelete")

    def delete_attributes(
        self, scope: Scope, entity: Entity, names: Iterable[str]
    ) -> tuple[str, ...]:
        """Delete attributes; returns the names of missing ones."""
        names = list(names)
        missing = tuple(name for name in names if name not in entity.attributes)
        for name in names:
            entity.attributes.pop(name, None)
        entity.modified = scope.now
        return missing

    # --- updates that may have to be passed on ----------------------------------

    async def update(
        self,
        scope: Scope,
        entity_id: str,
        entity_type: str,
        changes: Mapping[str, EntityChange],
        *,
        forced: bool = False,
    ) -> Outcome:
        """Change existing attributes; forward registered ones to their providers.

        Does the possible part and reports the rest.
        """
        tenant = self.tenant(scope.service)
        entity = self.known(scope, entity_id, entity_type)
        kind = entity.type if entity else entity_type
        own = entity.attributes if entity else {}
        local = {name: change for name, change in changes.items() if name in own}
        if entity is not None and local:
            self.append(scope, entity, local, forced=forced)
        rest = {name: one for name, one in changes.items() if name not in own}
        forwards = providers(tenant.registrations, scope, entity_id, kind, rest)
        taken = await asyncio.gather(
            *(
                forward_update(
                    registration,
                    entity_id,
                    kind,
                    {name: rest[name] for name in names},
                    scope,
                )
                for registration, names in forwards
            )
        )
        passed: list[str] = []
        failed: list[str] = []
        for (_, names), is_taken in zip(forwards, taken, strict=True):
            (passed if is_taken else failed).extend(names)
        return Outcome(
            entity_id,
            entity_type,
            kind,
            exists=entity is not None,
            updated=tuple(local),
            passed=tuple(passed),
            failed=tuple(failed),
            refused=tuple(name for name in rest if name not in (*passed, *failed)),
        )

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

    def _tell(
        self, scope: Scope, entity: Entity, touched: Touched, alteration: str
    ) -> None:
        tenant = self.tenant(scope.service)
        names = None if alteration == "entityDelete" else tuple(touched.now)
        correlator = scope.correlator
        for subscription in tenant.concerned(entity, names):
            if subscription.wants(touched, alteration, scope.now):
                correlator = correlator or self.outbox.correlator()
                self.outbox.post(
                    subscription,
                    entity,
                    touched,
                    alteration,
                    correlator,
                    scope.now,
                )
