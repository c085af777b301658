"""Cookies of the page: the session's, and what a browser has chosen."""

from typing import Final

LANGUAGE: Final = "iveg_language"
THEME: Final = "iveg_theme"
PALETTE: Final = "iveg_palette"


def session_cookie(*, secure: bool) -> str:
    """Name of the session's; a browser takes the prefix over TLS alone."""
    return "__Host-iveg" if secure else "iveg"
