"""An in-memory context broker that implements NGSI-v2 as Orion 4.7 does.

Its limits are listed in ``docs/fiware.md``.  HTTP is in ``ngsi_api``; this module has
the operations, which the embedded IoT Agent also calls directly.
"""

from collections.abc import Mapping

from iveg.adapters import clock
from iveg.lab.embedded.entities import Entity, EntityChange, Scope, Touched, apply
from iveg.lab.embedded.errors import ATTRIBUTE_NOT_FOUND, FiwareError, not_found
from iveg.lab.embedded.outbox import Outbox
from iveg.lab.embedded.outcomes import UpdateOutcome
from iveg.lab.embedded.providers import forward_updates
from iveg.lab.embedded.subscriptions import Subscription
from iveg.lab.embedded.tenants import Tenant


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
            FiwareError: 409 several.
        """
        entities = self.tenant(scope.service).entities
        return entities.find(scope.path, entity_id, entity_type)

    def find(self, scope: Scope, entity_id: str, entity_type: str = "") -> Entity:
        """Find the entity of an id and an optional type.

        Raises:
            FiwareError: 404 none, 409 several.
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
    ) -> None:
        """Create an entity and notify its subscriptions.

        Raises:
            FiwareError: 422, the entity exists already.
        """
        entities = self.tenant(scope.service).entities
        if entities.get(scope.path, entity_id, entity_type) is not None:
            raise FiwareError("Unprocessable", "Already Exists")
        entity = Entity(entity_id, entity_type, scope.path, scope.now, scope.now)
        touched = apply(entity, changes, scope.now)
        entities.add(entity)
        self._tell(scope, entity, touched, "entityCreate")

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

    def delete(self, scope: Scope, entity: Entity) -> None:
        """Delete an entity and notify its subscriptions."""
        tenant = self.tenant(scope.service)
        tenant.entities.remove(entity)
        self._tell(scope, entity, Touched(entity.attributes, all=True), "entityDelete")

    def delete_attribute(self, scope: Scope, entity: Entity, name: str) -> None:
        """Delete an attribute, of which nobody is notified.

        Raises:
            FiwareError: 404.
        """
        if name not in entity.attributes:
            raise not_found(ATTRIBUTE_NOT_FOUND)
        del entity.attributes[name]
        entity.modified = scope.now

    # --- updates that may have to be passed on ----------------------------------

    async def update(
        self,
        scope: Scope,
        entity_id: str,
        entity_type: str,
        changes: Mapping[str, EntityChange],
        *,
        forced: bool = False,
    ) -> UpdateOutcome:
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
        passed, failed = await forward_updates(
            tenant.registrations, scope, entity_id, kind, rest
        )
        return UpdateOutcome(
            entity_id,
            entity_type,
            kind,
            exists=entity is not None,
            updated=list(local),
            passed=passed,
            failed=failed,
            refused=[name for name in rest if name not in (*passed, *failed)],
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
