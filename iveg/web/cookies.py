"""Cookies of the page: the session, and the choices of a reader."""

from typing import Final

LANGUAGE: Final = "iveg_language"
THEME: Final = "iveg_theme"
PALETTE: Final = "iveg_palette"


def session_cookie(*, secure: bool) -> str:
    """Name of the session's cookie; browsers take the prefix only over TLS."""
    return "__Host-iveg" if secure else "iveg"
