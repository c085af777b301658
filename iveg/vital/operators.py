"""Choices of operators, in force at once and logged: rule, detectors, marks.

A new rule, a detector out of service and an answer to a word are on disk first.  Only
a detector out of service lifts a requirement of "clear" (docs/safety.md, "Clear"),
until the robot's next boot at the latest.  A mark, "not a person here", lasts until the
end of the day, until somebody takes it back or until iVeg's next start, whichever is
first: a forgotten mark protects.
"""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import OutOfService, WordAnswer
from iveg.domain.errors import MarkRefusedError, OutdatedError, UnknownNameError
from iveg.domain.events import LogEvent
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.things import LONGEST_S, MOST_THINGS, Thing
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.evaluate import Evaluator
from iveg.vital.evidence import thing_line

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Kept(Generic[_T]):
    """A choice that outlives a restart.

    Attributes:
        value: Choice of the last run.
        save: Replaces it; returns when the new value is on disk, or raises HopError.
    """

    value: _T
    save: Callable[[_T], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class KeptChoices:
    """Choices that people made while iVeg ran.

    Attributes:
        rules: Every version of the rule, oldest first; the last is in force.
        append_rule: Writes a new version, as ``Kept.save`` does.
        out_of_service: Detectors out of service, by robot.
        words: Operators' answers to words of detectors.
    """

    rules: Sequence[DetectionRule]
    append_rule: Callable[[DetectionRule], Awaitable[None]]
    out_of_service: Kept[Mapping[str, OutOfService]]
    words: Kept[Mapping[str, WordAnswer]]


class Rules:
    """Versions of the rule; the newest is in force.

    Attributes:
        versions: All of them, oldest first.
    """

    def __init__(self, core: Core, evaluator: Evaluator, kept: KeptChoices) -> None:
        self._evaluator, self._event_log = evaluator, core.event_log
        self._append = kept.append_rule
        # One change at a time: each takes the number after the version in force.
        self._lock = asyncio.Lock()
        self.versions = list(kept.rules)

    @property
    def current(self) -> DetectionRule:
        """The version in force."""
        return self._evaluator.rule

    async def change(
        self, wanted: DetectionRule, by: str, at: Instant, seen: int | None = None
    ) -> DetectionRule:
        """Put new parameters in force under the next version.

        Args:
            wanted: The parameters; its version, author and time are ignored.
            by: Name of the operator.
            at: Time of the change.
            seen: Version that the operator has edited; None skips the check.

        Raises:
            OutdatedError: another version is in force by now.
            HopError: it could not be written; the old version stays in force.
        """
        async with self._lock:
            before = self.current
            if seen is not None and seen != before.version:
                raise OutdatedError("The rule", seen, before.version)
            rule = replace(
                wanted,
                id=before.id,
                version=before.version + 1,
                author=by,
                since=at.wall,
            )
            # On disk first: a restart must not bring a replaced rule back into force.
            await self._append(rule)
            self._evaluator.rule = rule
            self.versions.append(rule)
        self._event_log.log(
            LogEvent("system", "log.rule_changed", {"by": by, "version": rule.version}),
            at,
        )
        # People's zones have the rule's radii, so pages must draw them anew.
        for topic in (topics.RULE, topics.PEOPLE):
            self._event_log.changed(topic.name)
        return rule


class Detectors:
    """Takes detectors out of service and puts them back, and answers their words."""

    def __init__(self, core: Core, kept: KeptChoices) -> None:
        self._world, self._event_log = core.world, core.event_log
        self._save_out, self._save_words = kept.out_of_service.save, kept.words.save
        self._lock = asyncio.Lock()
        for robot_id, entry in kept.out_of_service.value.items():
            # A robot may have left the fleet since.
            if robot_id in core.world.robots:
                core.world.robots[robot_id].detector.out_of_service = entry
        for answer in kept.words.value.values():
            core.world.word_answers.add(answer)

    async def set_in_service(
        self,
        robot_id: str,
        by: str,
        at: Instant,
        *,
        in_service: bool,
        reason: str = "",
    ) -> RobotState:
        """Put a detector in service, or take it out; returns its robot.

        Raises:
            UnknownRobotError: not in the fleet.
            HopError: it could not be written; nothing has changed.
        """
        robot = self._world.robot(robot_id)
        async with self._lock:
            # Another boot of the robot ends it (docs/safety.md, "Clear").
            boot = _boot_of(robot)
            entry = None if in_service else OutOfService(by, at.wall, boot, reason)
            robots = self._world.robots.values()
            out = {other.robot_id: other.detector.out_of_service for other in robots}
            out[robot_id] = entry
            await self._save_out({name: kept for name, kept in out.items() if kept})
            robot.detector.out_of_service = entry
        key = "log.detector_in" if in_service else "log.detector_out"
        slots = {"robot": robot_id, "by": by}
        if entry is not None:
            slots["reason"] = reason
        self._event_log.log(LogEvent("system", key, slots, robot_id), at)
        self._event_log.changed(topics.ROBOT.for_id(robot_id))
        return robot

    async def answer(self, answer: WordAnswer, at: Instant) -> None:
        """Take an answer to an unknown word, or a new answer to an answered one.

        Raises:
            UnknownNameError: the word is neither unknown nor answered.
            HopError: it could not be written; nothing has changed.
        """
        detector, word, answers = answer.detector, answer.word, self._world.word_answers
        vocabularies = [
            robot.detector.words[detector]
            for robot in self._world.robots.values()
            if detector in robot.detector.words
        ]
        is_unknown = any(word in words.unknown for words in vocabularies)
        if not is_unknown and (detector, word) not in answers.known:
            raise UnknownNameError("word", word)
        async with self._lock:
            known = answers.known | {(detector, word): answer}
            await self._save_words({"/".join(key): kept for key, kept in known.items()})
            answers.add(answer)
        for words in vocabularies:
            words.unknown.pop(word, None)
        key = "log.word_person" if answer.is_person else "log.word_harmless"
        slots = {"word": word, "detector": detector, "by": answer.by}
        self._event_log.log(LogEvent("system", key, slots), at)


def _boot_of(robot: RobotState) -> str | None:
    """Newest boot that the robot has reported."""
    newest = robot.odometry or robot.safety or robot.frame
    return None if newest is None else newest.origin.boot


class ThingMarks:
    """Marks tracks as things, and takes marks back."""

    def __init__(self, core: Core) -> None:
        self._people, self._things = core.people, core.people.things
        self._event_log = core.event_log
        self._marked = 0

    @property
    def known(self) -> Sequence[Thing]:
        """All marks, in the order of the operators' words."""
        return [*self._things.known.values()]

    def mark(self, person_id: str, by: str, until: float, at: Instant) -> Thing:
        """Mark the place of a track until ``until`` (Unix s) at the latest.

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
        # A mark hides its track from the rule, so it must not fit a possible person.
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
