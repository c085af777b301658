"""The web face in this process, on a clock that a test moves, before a real browser."""

import asyncio
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from queue import Queue
from typing import Any, Generic, TypeVar

from iveg.web.static_files import KeptFiles
from tests.processes import ROOT
from tests.threads import running
from tests.unit.web.security.test_people import PeoplesDesk

D = TypeVar("D", bound=PeoplesDesk)
_T = TypeVar("_T")


class Served(Generic[D]):
    """A desk in a loop of its own thread.

    Attributes:
        url: Where a browser finds it: by a name, for which browsers make passkeys.
    """

    def __init__(self, desk: D, loop: asyncio.AbstractEventLoop, port: str) -> None:
        self.desk, self._loop = desk, loop
        self.url = f"http://localhost:{port}"

    def run(self, work: Coroutine[Any, Any, _T]) -> _T:
        """What a coroutine gives, in the loop of the desk."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(30)


@contextmanager
def served(make: type[D]) -> Iterator[Served[D]]:
    """A desk that is served until the block ends."""
    found: Queue[Served[D]] = Queue()

    async def serve() -> None:
        desk = make()
        desk.app.mount("/static", KeptFiles(ROOT / "iveg/static"))
        await desk.people.refresh()
        try:
            async with desk.serving() as address:
                port = address.rpartition(":")[2]
                found.put(Served(desk, asyncio.get_running_loop(), port))
                await asyncio.Event().wait()
        finally:
            desk.close()

    with running(serve(), "desk"):
        yield found.get(timeout=30)
