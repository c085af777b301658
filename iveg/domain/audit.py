"""Actors of the audit: the people, programs and parts whose acts it keeps."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Actor:
    """A person, a program, or iVeg itself, as known at the moment of an act.

    Attributes:
        name: Shown on pages and stored; opaque to robots.
        person: Id of the account, as a name may change or pass to somebody else.
        method: Way of signing in.
    """

    name: str
    role: str
    person: str = ""
    method: str = "none"


ITSELF: Final = Actor("iVeg", "system", "iveg")
"""Actor of acts of iVeg itself, such as retention."""
STRANGER: Final = Actor("", "stranger")
"""Actor of a refused sign-in."""
CONSOLE: Final = Actor("console", "system", "console", "shell")
"""Actor of commands in a shell of the machine."""
