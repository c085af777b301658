"""Roles of people and programs, and their rights (SECURITY.md)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from iveg.domain.accounts import ACCOUNT_METHODS, SignInMethod
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
"""The table of SECURITY.md, "Roles"; any other action is refused."""


@dataclass(frozen=True, slots=True)
class Principal(Actor):
    """An authenticated person or program.

    Attributes:
        session: Digest of the session that lets them in (hex); None for programs.
        signed_in_at: Time of the sign-in (Unix s); None for programs.
    """

    role: Role
    method: SignInMethod = "link"
    session: str | None = None
    signed_in_at: float | None = None

    @property
    def has_account(self) -> bool:
        """Whether it is a person with an account, not the holder of a link or token."""
        return self.method in ACCOUNT_METHODS

    def may(self, action: Action) -> bool:
        """Whether the role's row holds this action."""
        return action in MAY[self.role]


NOBODY: Final = Principal("nobody", "expired")
"""Unknown caller of an open route; routes that require a role never get it."""

PROGRAM: Final = Principal("program", "program", "program", "token")
"""Any program with the one bearer token of the environment."""
