"""Staleness: links that fall silent, people who are remembered and expire."""

from iveg.domain.events import LogEvent, Slot
from iveg.domain.observations import Instant
from iveg.domain.robot_state import Link, RobotState
from iveg.domain.tracking.person import TrackedPerson
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.evidence import thing_line

_STAGE_KEYS = {
    "seen": "log.person_seen",
    "remembered": "log.person_remembered",
    "last_seen": "log.person_expired",
}


class Staleness:
    """Ages the world and logs each step of it."""

    def __init__(self, core: Core) -> None:
        self._world, self._people = core.world, core.people
        self._greenhouse, self._event_log = core.greenhouse, core.event_log
        self._links: dict[str, Link] = {}
        self._stages: dict[str, str] = {}

    def tick(self, now: Instant) -> None:
        """Compare every link and every person with the state that was logged last."""
        for robot in self._world.robots.values():
            self._watch_link(robot, now)
        people = self._people
        for person in people.known.values():
            self._log_stage(person, now)
        for thing in people.things.end(now):
            self._event_log.log(thing_line("log.thing_over", thing, thing.by), now)
            self._event_log.changed(topics.PEOPLE.name)
        for person in people.forget(now):
            self._stages.pop(person.person_id, None)
            self._event_log.changed(topics.PEOPLE.name)

    def _watch_link(self, robot: RobotState, now: Instant) -> None:
        link = robot.link(now)
        before = self._links.get(robot.robot_id, "UNKNOWN")
        if link == before:
            return
        self._links[robot.robot_id] = link
        self._event_log.changed(topics.ROBOT.of(robot.robot_id))
        if link == "UNKNOWN":
            # For as long as it takes to prove an age; if that fails, it is LOST.
            return
        age, slots = robot.age_s(now), dict[str, Slot](robot=robot.robot_id)
        key = "log.link.unproven" if age is None else f"log.link.{link.lower()}"
        if age is not None:
            slots["age"] = round(age, 1)
        self._event_log.log(LogEvent("link", key, slots, robot.robot_id), now)

    def _log_stage(self, person: TrackedPerson, now: Instant) -> None:
        stage = person.stage(now)
        before = self._stages.get(person.person_id)
        if stage == before:
            return
        self._stages[person.person_id] = stage
        self._event_log.changed(topics.PEOPLE.name)
        key = _STAGE_KEYS.get(stage)
        # The first sighting has a line of its own.
        if key is None or before is None:
            return
        newest = person.newest
        slots = {
            "person": person.person_id,
            "observer": newest.observer,
            "class": person.class_,
            "lane": self._greenhouse.lane_at(newest.x, newest.y) or "",
        }
        self._event_log.log(
            LogEvent("detection", key, slots, newest.observer, person.class_), now
        )
