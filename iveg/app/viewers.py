"""Who looks at the past: for each a process of its own, so that the loop feels nothing.

A process begins with the first question, keeps its world for the next, and ends when
nobody has asked for a while.  Where there are recordings some are always ready for who
comes next, because their imports alone take a second.
"""

import asyncio
import contextlib
from dataclasses import dataclass
from typing import Final

from iveg.adapters.worker import Worker
from iveg.app.past import Past
from iveg.app.site import Site
from iveg.domain.errors import (
    DataFileError,
    HopError,
    NotRecordedError,
    TooManyLookError,
    UnreadableError,
)
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.models.snapshot import PastWorld
from iveg.pipeline import topics
from iveg.pipeline.ports import Clock

MOST_VIEWERS: Final = 3
"""Processes at once; each holds a world of its own."""
MOST_READY: Final = 2
"""Processes for who comes next and after; fewer, but one, where that many look on."""
IDLE_S: Final = 60.0
_IN_USE_S: Final = 10.0
_LIMIT_S: Final = 60.0
_CHECK_S: Final = 1.0
_LOOKED_S: Final = 60.0
"""How often who stands ready looks at what was recorded meanwhile."""


@dataclass(frozen=True, slots=True)
class Shown:
    """What a process answers: the world as JSON, or why there is none."""

    world: bytes = b""
    missing: tuple[float, float | None, float | None] | None = None
    unreadable: tuple[str, str] | None = None


_past: dict[Site, Past] = {}
"""Of this process, which has one viewer."""


def world_at(site: Site, wall: float) -> Shown:
    """The world at a moment (Unix s); in the process of a viewer."""
    return asyncio.run(_world_at(site, wall))


def make_ready(site: Site) -> None:
    """Make the world before anybody asks for it; in the process of a viewer."""
    with contextlib.suppress(DataFileError):
        if site not in _past:
            _past[site] = Past(site)
        _past[site].look_through()


async def _world_at(site: Site, wall: float) -> Shown:
    """Orders of the past begin tasks, which end with the question: none gets out."""
    try:
        past = _past.get(site)
        if past is None:
            past = _past[site] = Past(site)
        past.move(wall)
    except NotRecordedError as error:
        return Shown(missing=(error.at, error.before, error.after))
    except UnreadableError as error:
        return Shown(unreadable=(error.reason, error.detail))
    except DataFileError as error:
        raise HopError("recordings", str(error)) from error
    return Shown(picture_of(past).model_dump_json().encode())


def picture_of(past: Past) -> PastWorld:
    """The world that a viewer is shown."""
    return PastWorld(
        at=format_stamp(past.now.wall),
        at_s=past.now.wall,
        verified=past.agreement.newest,
        recorded_twice=past.is_recorded_twice,
        scans=[past.views.scan(one) for one in past.parts.world.robots],
        **topics.read_all(past.views, past.now),
    )


@dataclass(slots=True)
class Viewer:
    """A process, and when it was asked last (monotonic, s)."""

    asked_at: float
    worker: Worker


def _worker() -> Worker:
    return Worker(limit_s=_LIMIT_S)


class Viewers:
    """All of them.

    Args:
        site: What worlds are made with.
        clock: Tells who has not asked for long.
        has_spares: Whether processes are kept ready for the next viewers.
    """

    def __init__(self, site: Site, clock: Clock, *, has_spares: bool = False) -> None:
        self._site, self._clock, self._has_spares = site, clock, has_spares
        self._viewers: dict[str, Viewer] = {}
        self._spares: list[Worker] = []
        self._looked_at = float("-inf")

    @property
    def count(self) -> int:
        """How many processes there are."""
        return len(self._viewers)

    async def world(self, viewer: str, wall: float) -> bytes:
        """The world at a moment as JSON, for a viewer by any name of its own.

        Raises:
            NotRecordedError: nothing was recorded there.
            UnreadableError: another version or fleet recorded it.
            TooManyLookError: as many look at once as may.
            HopError: the process ended.
        """
        shown = await self.viewer(viewer).worker.run(world_at, self._site, wall)
        if shown.missing is not None:
            raise NotRecordedError(*shown.missing)
        if shown.unreadable is not None:
            raise UnreadableError(*shown.unreadable)
        return shown.world

    def viewer(self, name: str) -> "Viewer":
        """A viewer by name, old or new.  Raises TooManyLookError."""
        now = self._clock().mono
        viewer = self._viewers.get(name)
        if viewer is None:
            worker = self._freed(now) or self._ready()
            viewer = self._viewers[name] = Viewer(now, worker)
        viewer.asked_at = now
        return viewer

    def _ready(self) -> Worker:
        return self._spares.pop(0) if self._spares else _worker()

    def _freed(self, now: float) -> Worker | None:
        """The process of who has not asked for longest, if there must be no more."""
        if len(self._viewers) < MOST_VIEWERS:
            return None
        oldest = min(self._viewers, key=lambda one: self._viewers[one].asked_at)
        if now - self._viewers[oldest].asked_at < _IN_USE_S:
            raise TooManyLookError
        worker = self._viewers[oldest].worker
        if worker.is_busy:
            self._end(oldest)
            return None
        del self._viewers[oldest]
        return worker

    async def run(self) -> None:
        """End what nobody asks any more, and keep some ready, until cancelled."""
        while True:
            self.tick(self._clock())
            await self.keep_ready()
            await asyncio.sleep(_CHECK_S)

    async def keep_ready(self) -> None:
        """Have processes for the next viewers, where they are wanted."""
        if not self._has_spares:
            return
        now, wanted = self._clock().mono, min(MOST_READY, MOST_VIEWERS - self.count)
        new = [_worker() for _ in range(max(1, wanted) - len(self._spares))]
        self._spares += new
        if now - self._looked_at >= _LOOKED_S:
            self._looked_at, new = now, list(self._spares)
        for spare in new:
            # Who comes meanwhile has this one, and waits in its line.
            with contextlib.suppress(HopError):
                await spare.run(make_ready, self._site)

    def tick(self, now: Instant) -> None:
        """End what nobody asks any more."""
        for name, viewer in list(self._viewers.items()):
            if now.mono - viewer.asked_at > IDLE_S:
                self._end(name)

    def _end(self, name: str) -> None:
        self._viewers.pop(name).worker.close()

    async def close(self) -> None:
        """End all."""
        for name in list(self._viewers):
            self._end(name)
        for spare in self._spares:
            spare.close()
