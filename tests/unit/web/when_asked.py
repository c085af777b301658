"""Routes that are made when somebody asks for one of them.

FastAPI takes 30 ms of a processor to make all routes of now; a test has a web face of
its own, and asks for the routes of one router or two.
"""

from collections.abc import Callable, Sequence

from fastapi import APIRouter, FastAPI
from starlette.routing import BaseRoute, Match
from starlette.types import ASGIApp, Receive, Scope, Send

Make = Callable[[], APIRouter]
_likes: list[Sequence[BaseRoute]] = []
"""The routes of each router of the first face of this process, in order: what they are
asked by is the same in all faces."""


class RoutesWhenAsked:
    """Adds the routers of a face that may have what is asked for.

    Args:
        app: Answers.
        face: Where they are added.
        makers: What makes each router of now, in order.
    """

    def __init__(self, app: ASGIApp, face: FastAPI, makers: Sequence[Make]) -> None:
        self._app, self._face = app, face
        if not _likes:
            _likes.extend(make().routes for make in makers)
        self._waiting = dict(enumerate(makers))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "lifespan":
            for number in [it for it in self._waiting if _may_answer(it, scope)]:
                # As the product does: FastAPI would make what is included once more.
                self._face.router.routes.extend(self._waiting.pop(number)().routes)
        await self._app(scope, receive, send)


def _may_answer(number: int, scope: Scope) -> bool:
    return any(like.matches(scope)[0] is not Match.NONE for like in _likes[number])
