"""Libraries that only some commands need: the extras of the package (pyproject.toml).

A site that runs ``iveg serve`` on a real FIWARE installs neither a driver of
PostgreSQL nor DDS.  A command that needs one checks here first, so that all report a
missing library in the same words.
"""

from importlib.util import find_spec
from typing import Final

from iveg.domain.errors import MissingExtraError

EXTRAS: Final = {
    "postgresql": "psycopg",
    "ros2": "cyclonedds",
    "sso": "httpx2",
}
"""Extra → module of its library; of several libraries the one added last."""


def require_extra(extra: str, what: str) -> None:
    """Check that the library of an extra is installed, without importing it.

    Args:
        extra: A key of ``EXTRAS``.
        what: Command, option or setting that needs it, in words.

    Raises:
        MissingExtraError: it is not installed.
    """
    if find_spec(EXTRAS[extra]) is None:
        raise MissingExtraError(what, EXTRAS[extra], extra)
