"""Texts from the wire: which are safe to keep and to show."""

import unicodedata

MAX_TEXT = 64


FORBIDDEN = frozenset("<>\"'=;()")
"""Characters that Orion refuses, with the whole update they stand in."""


def clean_text(text: str) -> str:
    """Text that is safe to keep and show: NFC, no control or format marks, short."""
    if text.isascii() and text.isprintable():
        # Nearly all is plain, and plain text needs no look at each character.
        return text[:MAX_TEXT]
    kept = "".join(
        c
        for c in unicodedata.normalize("NFC", text[: 4 * MAX_TEXT])
        if unicodedata.category(c)[0] != "C"
    )
    return kept[:MAX_TEXT]


def legible(text: str) -> str:
    """Text without characters that are unseen or turn others round (Cc, Cf, Cs …).

    Line ends stay.
    """
    return "".join(c for c in text if c == "\n" or unicodedata.category(c)[0] != "C")


def all_legible(value: object) -> object:
    """JSON with every text in it legible."""
    match value:
        case str():
            return legible(value)
        case list():
            return [all_legible(one) for one in value]
        case dict():
            return {legible(name): all_legible(one) for name, one in value.items()}
    return value
