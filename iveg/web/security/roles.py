"""Roles of people and programs, and what each may do (SECURITY.md)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from iveg.domain.accounts import OF_ACCOUNTS, SignInMethod
from iveg.domain.audit import Actor

Role = Literal[
    "viewer", "operator", "admin", "reader", "program", "controller", "expired"
]
Action = Literal["open", "read", "stop", "release", "admin"]

MAY: Final[Mapping[Role, frozenset[Action]]] = {
    "viewer": frozenset({"open", "read", "stop"}),
    "operator": frozenset({"open", "read", "stop", "release"}),
    "admin": frozenset({"open", "read", "stop", "release", "admin"}),
    "reader": frozenset({"open", "read"}),
    "program": frozenset({"open", "read", "stop"}),
    "controller": frozenset({"open", "read", "stop", "release"}),
    "expired": frozenset({"open", "stop"}),
}
"""The table of SECURITY.md, "Roles"; what is not here is refused."""


@dataclass(frozen=True, slots=True)
class Principal(Actor):
    """An authenticated person or program.

    Attributes:
        session: Digest of the session that lets them in; None for programs.
        signed_in_at: When (Unix s); None for programs, which do so at each request.
    """

    role: Role
    method: SignInMethod = "link"
    session: bytes | None = None
    signed_in_at: float | None = None

    @property
    def has_account(self) -> bool:
        """Whether it is a person by name, not whoever holds a link or a token."""
        return self.method in OF_ACCOUNTS

    def may(self, action: Action) -> bool:
        """Whether the role's row holds this action."""
        return action in MAY[self.role]


NOBODY: Final = Principal("nobody", "expired")
"""Unknown caller of an open route; never passed to a route that requires a role."""

PROGRAM: Final = Principal("program", "program", "program", "token")
"""Any program with the one bearer token of the environment."""
