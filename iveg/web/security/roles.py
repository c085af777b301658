"""Roles of people and programs, and what each may do (SECURITY.md)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

Role = Literal["viewer", "operator", "admin", "program", "expired"]
Action = Literal["open", "read", "stop", "release", "admin"]

MAY: Final[Mapping[Role, frozenset[Action]]] = {
    "viewer": frozenset({"open", "read", "stop"}),
    "operator": frozenset({"open", "read", "stop", "release"}),
    "admin": frozenset({"open", "read", "stop", "release", "admin"}),
    "program": frozenset({"open", "read", "stop"}),
    "expired": frozenset({"open", "stop"}),
}
"""The table of SECURITY.md, "Roles"; what is not here is refused."""


@dataclass(frozen=True, slots=True)
class Principal:
    """An authenticated person or program.

    Attributes:
        name: For the audit and the page; opaque to robots.
        session: Digest of the session that lets them in; None for programs.
    """

    name: str
    role: Role
    session: bytes | None = None

    def may(self, action: Action) -> bool:
        """Whether the role's row holds this action."""
        return action in MAY[self.role]


NOBODY = Principal("nobody", "expired")
"""Unknown caller of an open route; never passed to a route that requires a role."""
