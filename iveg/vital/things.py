"""Marks of operators, "not a person here": at once, on the record.

A mark lasts until the end of the day, until somebody takes it back or until iVeg's next
start, whichever is first: forgetting one protects.
"""

from collections.abc import Sequence

from iveg.domain.errors import MarkRefusedError, UnknownNameError
from iveg.domain.events import LogEvent, Slot
from iveg.domain.observations import Instant
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import LONGEST_S, MOST_THINGS, Thing
from iveg.vital import topics
from iveg.vital.event_log import EventLog


class ThingMarks:
    """Marks tracks as things, and takes marks back."""

    def __init__(self, people: People, event_log: EventLog) -> None:
        self._people = people
        self._things = people.things
        self._event_log = event_log
        self._marked = 0

    @property
    def known(self) -> Sequence[Thing]:
        """All marks, in the order of the operators' words."""
        return [*self._things.known.values()]

    def mark(self, person_id: str, by: str, until: float, at: Instant) -> Thing:
        """Mark where a track is; ``until`` when at the latest (Unix s).

        Raises:
            UnknownNameError: no such track.
            MarkRefusedError: it may be a person, or there are too many marks.
        """
        person = self._people.known.get(person_id)
        if person is None:
            raise UnknownNameError("person", person_id)
        if len(self._things.known) >= MOST_THINGS:
            raise MarkRefusedError("too_many")
        lasts_s = min(LONGEST_S, until - at.wall)
        end = Instant(wall=at.wall + lasts_s, mono=at.mono + lasts_s)
        thing = Thing(f"T{self._marked + 1}", *person.middle, by, at, end)
        if not thing.explains(person):
            raise MarkRefusedError("somebody")
        self._marked += 1
        self._things.known[thing.thing_id] = thing
        self._log("log.thing_marked", thing, thing.by, thing.since)
        return thing

    def unmark(self, thing_id: str, by: str, at: Instant) -> Thing:
        """Take a mark back.

        Raises:
            UnknownNameError: no such mark.
        """
        thing = self._things.known.pop(thing_id, None)
        if thing is None:
            raise UnknownNameError("thing", thing_id)
        self._log("log.thing_unmarked", thing, by, at)
        return thing

    def _log(self, key: str, thing: Thing, by: str, at: Instant) -> None:
        self._event_log.log(thing_line(key, thing, by), at)
        self._event_log.changed(topics.PEOPLE.name)


def thing_line(key: str, thing: Thing, by: str) -> LogEvent:
    """A line of the log: a mark was made, taken back, or is over."""
    slots: dict[str, Slot] = {"by": by, "x": round(thing.x, 2), "y": round(thing.y, 2)}
    return LogEvent("system", key, slots)
