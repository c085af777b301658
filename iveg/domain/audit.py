"""The audit: who did what."""

import json
from dataclasses import dataclass
from typing import Final, Protocol

from iveg.domain.records import AuditRecord, Json


class Actor(Protocol):
    """Whoever acts: a person, a program, or iVeg itself."""

    @property
    def person(self) -> str:
        """Id of the account."""

    @property
    def name(self) -> str:
        """Name at that moment."""

    @property
    def role(self) -> str:
        """Role at that moment."""

    @property
    def method(self) -> str:
        """Proof of the identity."""


@dataclass(frozen=True, slots=True)
class NamedActor:
    """An actor of whom no request tells: iVeg itself, or a stranger."""

    person: str
    name: str
    role: str
    method: str


ITSELF: Final = NamedActor("iveg", "iVeg", "system", "none")
"""Actor of acts that nobody asked for, such as retention."""
STRANGER: Final = NamedActor("", "", "stranger", "none")
"""Whoever tries to sign in."""
CONSOLE: Final = NamedActor("console", "console", "system", "shell")
"""Whoever calls ``iveg`` on the machine itself."""


def act_of(
    actor: Actor, action: str, subject: str, details: Json, *, audit_id: str, at: float
) -> AuditRecord:
    """Record of an act at a moment (Unix s)."""
    return AuditRecord(
        audit_id=audit_id,
        at=at,
        person=actor.person,
        name=actor.name,
        role=actor.role,
        method=actor.method,
        action=action,
        subject=subject,
        details=json.dumps(details, sort_keys=True, separators=(",", ":")),
    )
