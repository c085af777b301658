"""Result of an update, and Orion's error sentence for it.

An update of one entity and a batch do the possible part and then report the rest.  The
error depends on whether any part was done::

    none of the entities exists                → 404 NotFound (batch)
    no attribute could be changed              → 422 Unprocessable
    some attributes could be changed           → 422 PartialUpdate
    a provider took part, and not all was done → 404 PartialUpdate
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from iveg.lab.embedded.errors import FiwareError, not_found

_MISSING = "do not exist: "


@dataclass(frozen=True, slots=True)
class UpdateOutcome:
    """Result of an update of one entity.

    Attributes:
        asked_kind: The type that the request named; empty if none.
        kind: The type of the entity, as far as known.
        exists: Whether the entity is stored here.
        updated: Own attributes that were changed.
        passed: Attributes that a provider accepted.
        failed: Attributes that a provider did not accept.
        refused: Attributes that do not exist.
    """

    entity_id: str
    asked_kind: str
    kind: str
    exists: bool
    updated: list[str]
    passed: list[str]
    failed: list[str]
    refused: list[str]

    @property
    def forwarded(self) -> bool:
        """Whether a provider took part."""
        return bool(self.passed or self.failed)

    @property
    def complete(self) -> bool:
        """Whether the whole request was done."""
        known = self.exists or self.forwarded
        return known and not self.refused and not self.failed

    def raise_for_one(self) -> None:
        """Raise Orion's error for an update of one entity, if there is one.

        A changed own attribute hides a command that was not forwarded.

        Raises:
            FiwareError: 404 or 422.
        """
        if self.complete or (self.updated and not self.refused):
            return
        if not self.updated and not self.passed and (self.failed or not self.exists):
            raise not_found()
        if self.forwarded:
            raise _not_passed_on([self])
        raise _refused(bool(self.updated), _MISSING + _complaint(self, first=True))


def raise_for_batch(outcomes: Sequence[UpdateOutcome]) -> None:
    """Raise Orion's error for ``op/update``, if there is one.

    Raises:
        FiwareError: 404 or 422.
    """
    bad = [one for one in outcomes if not one.complete]
    if any(one.forwarded for one in outcomes):
        if len(outcomes) == 1:
            outcomes[0].raise_for_one()
        elif bad:
            raise _not_passed_on(bad)
    if not bad:
        return
    description = _MISSING + ", ".join(
        _complaint(one, first=number == 0) for number, one in enumerate(bad)
    )
    if not any(one.exists for one in outcomes):
        raise not_found(description)
    some = len(bad) < len(outcomes) or any(one.updated for one in bad)
    raise _refused(some, description)


def _complaint(outcome: UpdateOutcome, *, first: bool) -> str:
    named = f"{outcome.entity_id}/{outcome.asked_kind}".removesuffix("/")
    if outcome.exists:
        return f"{named} - [ {', '.join(outcome.refused)} ]"
    # Orion omits the dash for all but the first.
    return f"{named} {'- ' if first else ''}[entity itself]"


def _refused(some: bool, description: str) -> FiwareError:
    return FiwareError("PartialUpdate" if some else "Unprocessable", description)


def _not_passed_on(outcomes: Iterable[UpdateOutcome]) -> FiwareError:
    named = ", ".join(
        f"{one.entity_id}-{one.kind} : [{', '.join((*one.refused, *one.failed))}]"
        for one in outcomes
    )
    return FiwareError(
        "PartialUpdate",
        f"Some of the following attributes were not updated: {{ {named} }}",
        status=404,
    )
