"""The data of one tenant."""

from dataclasses import dataclass, field

from iveg.lab.embedded.entities import Entity, under
from iveg.lab.embedded.errors import too_many
from iveg.lab.embedded.registrations import Registration
from iveg.lab.embedded.subscriptions import Subscription

_MOST_CONCERNED = 10_000


class EntityStore:
    """All entities of one tenant."""

    def __init__(self) -> None:
        self._by_key: dict[tuple[str, str, str], Entity] = {}

    def get(self, path: str, entity_id: str, entity_type: str) -> Entity | None:
        """The entity of exactly this key."""
        return self._by_key.get((path, entity_id, entity_type))

    def find(self, paths: str, entity_id: str, entity_type: str = "") -> Entity | None:
        """Find the entity of an id and an optional type.

        Raises:
            FiwareError: 409, several entities match.
        """
        found = [
            one
            for one in self.all(paths)
            if one.id == entity_id and entity_type in ("", one.type)
        ]
        if len(found) > 1:
            raise too_many()
        return found[0] if found else None

    def all(self, paths: str) -> list[Entity]:
        """Every entity under a service path, oldest first."""
        return [one for one in self._by_key.values() if under(paths, one.path)]

    def add(self, entity: Entity) -> None:
        """Store a new entity."""
        self._by_key[entity.key] = entity

    def remove(self, entity: Entity) -> None:
        """Delete an entity."""
        del self._by_key[entity.key]


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
