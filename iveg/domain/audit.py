"""Actors of the audit: the people, programs and parts whose acts it keeps."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Actor:
    """A person, a program, or iVeg itself, as known at the moment of an act.

    Attributes:
        name: For the record and the page; opaque to robots.
        person: Id of the account; names may change and be given anew.
        method: Proof of the identity.
    """

    name: str
    role: str
    person: str = ""
    method: str = "none"


ITSELF: Final = Actor("iVeg", "system", "iveg")
"""Actor of acts that nobody asked for, such as retention."""
STRANGER: Final = Actor("", "stranger")
"""Actor of a sign-in that was refused."""
CONSOLE: Final = Actor("console", "system", "console", "shell")
"""Actor of ``iveg`` on the machine itself."""
