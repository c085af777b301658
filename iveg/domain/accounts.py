"""People who sign in: how they may be called, and how they came in.

A name travels with each STOP through Orion, which refuses some characters with the
whole update they stand in; such a name would stop nothing by that transport.
"""

import unicodedata
from typing import Final, Literal

SignInMethod = Literal["link", "token"]
"""Proof of an identity: the link's token, or a program's bearer token."""

LINK_PERSON: Final = "link"
"""Id of whoever holds the link of the environment."""
DEFAULT_NAME: Final = "operator"
"""The name of that person where the settings give none."""
MOST_NAME: Final = 64
_REFUSED: Final = frozenset("<>\"'=;()")


def is_name(text: str) -> bool:
    """Whether a person may be called so: short, visible, and taken by Orion."""
    return (
        0 < len(text) <= MOST_NAME
        and text == unicodedata.normalize("NFC", text).strip()
        and _REFUSED.isdisjoint(text)
        and not any(unicodedata.category(one)[0] == "C" for one in text)
    )
