"""Answers to programs and the page: models as JSON, written once; long work apart."""

from collections.abc import Callable
from typing import ParamSpec, Protocol, TypeVar

from starlette.responses import Response

from iveg.models.base import write_json

_P = ParamSpec("_P")
_T = TypeVar("_T")


class Json(Response):
    """A JSON answer that is written once, by orjson."""

    media_type = "application/json"

    def render(self, content: object) -> bytes:
        """The bytes of the answer."""
        return write_json(content)


class Apart(Protocol):
    """Where work runs that would hold up the loop: ``adapters.worker``."""

    async def run(
        self, work: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs
    ) -> _T:
        """Run a function of a module there, and return its answer.

        Raises:
            HopError: it raised one, or could not be done.
        """
