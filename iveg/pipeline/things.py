"""Marks of operators, "not a person here" and "known here": at once, on the record.

A mark lasts until the end of the day, until somebody takes it back or until iVeg's next
start, whichever is first: forgetting one protects.
"""

import math
from collections.abc import Callable, Sequence

from iveg.domain.errors import MarkRefusedError, UnknownNameError
from iveg.domain.events import LogEvent, Slot
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.obstacle import Obstacle
from iveg.domain.tracking.people import People
from iveg.domain.tracking.things import (
    LONGEST_S,
    MOST_THINGS,
    RADIUS_M,
    Kind,
    Thing,
)
from iveg.pipeline import topics
from iveg.pipeline.event_log import EventLog

Shown = Callable[[str, Instant], Obstacle | None]
"""Robot, now → what its laser saw near it that nobody explains."""
_WORDS: dict[Kind, str] = {"person": "thing", "obstacle": "known"}


class ThingMarks:
    """Marks tracks and obstacles as things, and takes marks back."""

    def __init__(self, people: People, event_log: EventLog, shown: Shown) -> None:
        self._people = people
        self._things = people.things
        self._event_log = event_log
        self._shown = shown
        self._marked = 0

    @property
    def known(self) -> Sequence[Thing]:
        """All marks, in the order of the operators' words, by kind."""
        return self._things.all

    def mark(self, person_id: str, by: str, until: float, at: Instant) -> Thing:
        """Mark where a track is; ``until`` when at the latest (Unix s).

        Raises:
            UnknownNameError: no such track.
            MarkRefusedError: it may be a person, or there are too many marks.
        """
        person = self._people.known.get(person_id)
        if person is None:
            raise UnknownNameError("person", person_id)
        thing = self._new("person", person.middle, by, until, at)
        if not thing.explains(person):
            raise MarkRefusedError("somebody")
        return self._keep(thing)

    def mark_obstacle(self, robot_id: str, by: str, until: float, at: Instant) -> Thing:
        """Mark what a robot is slowed for by its laser; ``until`` as above.

        Raises:
            UnknownNameError: its laser saw nothing lately.
            MarkRefusedError: it moved, somebody is there, or there are too many marks.
        """
        seen = self._shown(robot_id, at)
        if seen is None:
            raise UnknownNameError("obstacle", robot_id)
        middle = seen.around.middle
        thing = self._new("obstacle", middle, by, until, at)
        if not thing.place.explains(seen) or self._is_somebody_at(*middle, at):
            raise MarkRefusedError("somebody")
        return self._keep(thing)

    def _is_somebody_at(self, x: float, y: float, at: Instant) -> bool:
        return any(
            ring.age_s(at) <= LIMITS.seen_s
            and math.hypot(ring.x - x, ring.y - y) <= RADIUS_M
            for person in self._people.known.values()
            for ring in person.sightings
        )

    def _new(
        self,
        kind: Kind,
        middle: tuple[float, float],
        by: str,
        until: float,
        at: Instant,
    ) -> Thing:
        if len(self._things.all) >= MOST_THINGS:
            raise MarkRefusedError("too_many")
        lasts_s = min(LONGEST_S, until - at.wall)
        end = Instant(wall=at.wall + lasts_s, mono=at.mono + lasts_s)
        self._marked += 1
        return Thing(f"T{self._marked}", *middle, by, at, end, kind)

    def _keep(self, thing: Thing) -> Thing:
        self._things.add(thing)
        self._log("marked", thing, thing.by, thing.since)
        return thing

    def unmark(self, thing_id: str, by: str, at: Instant) -> Thing:
        """Take a mark back.

        Raises:
            UnknownNameError: no such mark.
        """
        thing = self._things.pop(thing_id)
        if thing is None:
            raise UnknownNameError("thing", thing_id)
        self._log("unmarked", thing, by, at)
        return thing

    def _log(self, what: str, thing: Thing, by: str, at: Instant) -> None:
        self._event_log.log(thing_line(what, thing, by), at)
        self._event_log.changed(topics.PEOPLE.name)


def thing_line(what: str, thing: Thing, by: str) -> LogEvent:
    """A line of the log: a mark was ``marked``, ``unmarked``, or is ``over``."""
    slots: dict[str, Slot] = {"by": by, "x": round(thing.x, 2), "y": round(thing.y, 2)}
    return LogEvent("system", f"log.{_WORDS[thing.kind]}_{what}", slots)
