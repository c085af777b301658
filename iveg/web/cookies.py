"""Cookies of the page: the session's, and what a browser has chosen."""

from typing import Final

from starlette.responses import Response

LANGUAGE: Final = "iveg_language"
THEME: Final = "iveg_theme"
PALETTE: Final = "iveg_palette"
_YEAR_S = 31_536_000


def session_cookie(*, secure: bool) -> str:
    """Name of the session's; a browser takes the prefix over TLS alone."""
    return "__Host-iveg" if secure else "iveg"


def keep_language(response: Response, language: str) -> None:
    """Have the browser speak a language, as its own switch would; "" leaves it."""
    if language:
        response.set_cookie(LANGUAGE, language, max_age=_YEAR_S, samesite="strict")
