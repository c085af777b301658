"""A robot that is heard no more, by an admin's word (docs/robots.md, "Revoking")."""

from dataclasses import dataclass
from typing import Literal

BrokerTold = Literal["done", "failed", "not_asked"]
"""What came of asking the broker to let a robot in no more, or again; ``not_asked``:
the site has no command for it."""


@dataclass(frozen=True, slots=True)
class Revocation:
    """Whose word it was, and when.

    Attributes:
        since: Unix s.
        stood: Whether the STOP before it was confirmed by a standstill.
    """

    by: str
    since: float
    stood: bool
