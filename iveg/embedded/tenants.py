"""Tenants with their data."""

from dataclasses import dataclass, field

from iveg.embedded.entities import Entity, EntityStore, under
from iveg.embedded.registrations import Registration
from iveg.embedded.subscriptions import Subscription

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
