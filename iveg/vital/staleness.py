"""Staleness: links that fall silent, marks and people that expire."""

from iveg.domain.events import LogEvent, Slot
from iveg.domain.observations import Instant
from iveg.domain.robot_state import Link, RobotState
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.evidence import thing_line


class Staleness:
    """Ages the world and logs each step of it."""

    def __init__(self, core: Core) -> None:
        self._world, self._people = core.world, core.people
        self._event_log = core.event_log
        self._links: dict[str, Link] = {}

    def tick(self, now: Instant) -> None:
        """Log changed links and expired marks, and forget people."""
        for robot in self._world.robots.values():
            self._watch_link(robot, now)
        people = self._people
        for thing in people.things.end(now):
            self._event_log.log(thing_line("log.thing_over", thing, thing.by), now)
            self._event_log.changed(topics.PEOPLE.name)
        if people.forget(now):
            self._event_log.changed(topics.PEOPLE.name)

    def _watch_link(self, robot: RobotState, now: Instant) -> None:
        link = robot.link(now)
        if link == self._links.get(robot.robot_id, "UNKNOWN"):
            return
        self._links[robot.robot_id] = link
        self._event_log.changed(topics.ROBOT.for_id(robot.robot_id))
        if link == "UNKNOWN":
            # UNKNOWN lasts until an age is proven, and becomes LOST where none is.
            return
        age, slots = robot.age_s(now), dict[str, Slot](robot=robot.robot_id)
        key = "log.link.unproven" if age is None else f"log.link.{link.lower()}"
        if age is not None:
            slots["age"] = round(age, 1)
        self._event_log.log(LogEvent("link", key, slots, robot.robot_id), now)
