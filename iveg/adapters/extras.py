"""Libraries that only some commands need: the extras of the package (pyproject.toml).

A site that runs ``iveg serve`` on a real FIWARE installs neither a driver of
PostgreSQL nor DDS.  A command that needs one asks here first, so that all of them say
in the same words what is missing.
"""

from importlib.util import find_spec
from typing import Final

from iveg.domain.errors import MissingExtraError

EXTRAS: Final = {
    "postgresql": "psycopg",
    "ros2": "cyclonedds",
    "sso": "authlib",
}
"""Extra → the module of the library that it brings."""


def has_extra(extra: str) -> bool:
    """Whether the library of an extra is installed; it is not imported."""
    return find_spec(EXTRAS[extra]) is not None


def require_extra(extra: str, what: str) -> None:
    """Go on only where the library of an extra is installed; it is not imported.

    Args:
        extra: One of ``EXTRAS``.
        what: What needs it, in words: a command, an option or a setting.

    Raises:
        MissingExtraError: it is not.
    """
    if not has_extra(extra):
        raise MissingExtraError(what, EXTRAS[extra], extra)
