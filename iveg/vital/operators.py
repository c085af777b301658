"""Choices of operators that count at once and are logged: rule, detectors, marks.

A new rule, a detector out of service and an answer to a word are on disk first.  A
detector out of service lifts a requirement of the claim "clear" (docs/safety.md,
"Clear"), as nothing else does; that ends with the robot's next boot at the latest.  A
mark, "not a person here", lasts until the end of the day, until somebody takes it back
or until iVeg's next start, whichever is first: forgetting one protects.
"""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import OutOfService
from iveg.domain.errors import MarkRefusedError, OutdatedError, UnknownNameError
from iveg.domain.events import LogEvent, Slot
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.person import LONGEST_S, MOST_THINGS, Thing
from iveg.domain.words import WordAnswer
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.evaluate import Evaluator
from iveg.vital.evidence import thing_line

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Kept(Generic[_T]):
    """A choice that outlives a restart.

    Attributes:
        value: As the last run left it.
        save: Writes another in its place; returns when it is on disk, or raises
            HopError.
    """

    value: _T
    save: Callable[[_T], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class KeptChoices:
    """Choices that people made while iVeg ran.

    Attributes:
        rules: Every version of the rule, oldest first; the last is in force.
        append_rule: Writes one more, as ``Kept.save`` does.
        out_of_service: Detectors that nobody waits for, by robot.
        words: What operators said of words of detectors.
    """

    rules: Sequence[DetectionRule]
    append_rule: Callable[[DetectionRule], Awaitable[None]]
    out_of_service: Kept[Mapping[str, OutOfService]]
    words: Kept[Mapping[str, WordAnswer]]


class Rules:
    """The versions of the rule; the newest is the one in force.

    Attributes:
        versions: All of them, oldest first.
    """

    def __init__(self, core: Core, evaluator: Evaluator, kept: KeptChoices) -> None:
        self._evaluator, self._event_log = evaluator, core.event_log
        self._append = kept.append_rule
        self._one_by_one = asyncio.Lock()
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
            wanted: The parameters; its version, author and time are not looked at.
            by: Who wants it.
            at: When.
            seen: The version that they have changed; None does not ask.

        Raises:
            OutdatedError: somebody else was faster.
            HopError: it could not be written down; the old version stays in force.
        """
        async with self._one_by_one:
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
            await self._append(rule)
            self._evaluator.rule = rule
            self.versions.append(rule)
        facts: dict[str, Slot] = {"by": by, "version": rule.version}
        self._event_log.rule(LogEvent("system", "log.rule_changed", facts), at)
        return rule


class Detectors:
    """Takes detectors out of service and puts them back, and answers their words."""

    def __init__(self, core: Core, kept: KeptChoices) -> None:
        self._world, self._event_log = core.world, core.event_log
        self._save_out, self._save_words = kept.out_of_service.save, kept.words.save
        self._one_by_one = asyncio.Lock()
        for robot_id, word in kept.out_of_service.value.items():
            if robot_id in core.world.robots:
                core.world.robots[robot_id].detector.out_of_service = word
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
            HopError: it could not be written down; nothing has changed.
        """
        robot = self._world.robot(robot_id)
        async with self._one_by_one:
            boot = _boot_of(robot)
            word = None if in_service else OutOfService(by, at.wall, boot, reason)
            out = self._out_of_service() | {robot_id: word}
            await self._save_out({name: one for name, one in out.items() if one})
            robot.detector.out_of_service = word
        key = "log.detector_in" if in_service else "log.detector_out"
        slots = {"robot": robot_id, "by": by}
        if word is not None:
            slots["reason"] = reason
        self._event_log.log(LogEvent("system", key, slots, robot_id), at)
        self._event_log.changed(topics.ROBOT.of(robot_id))
        return robot

    async def answer(self, answer: WordAnswer, at: Instant) -> None:
        """Take an answer to a word that was asked for, or another one in its place.

        Raises:
            UnknownNameError: nobody asked.
            HopError: it could not be written down; nothing has changed.
        """
        detector, word, answers = answer.detector, answer.word, self._world.word_answers
        heard = [
            robot.detector.words[detector]
            for robot in self._world.robots.values()
            if detector in robot.detector.words
        ]
        is_asked = any(word in one.unknown for one in heard)
        if not is_asked and (detector, word) not in answers.known:
            raise UnknownNameError("word", word)
        async with self._one_by_one:
            every = answers.known | {(detector, word): answer}
            await self._save_words({"/".join(key): one for key, one in every.items()})
            answers.add(answer)
        for one in heard:
            one.unknown.pop(word, None)
        key = "log.word_person" if answer.is_person else "log.word_harmless"
        slots = {"word": word, "detector": detector, "by": answer.by}
        self._event_log.log(LogEvent("system", key, slots), at)

    def _out_of_service(self) -> dict[str, OutOfService | None]:
        robots = self._world.robots.values()
        return {robot.robot_id: robot.detector.out_of_service for robot in robots}


def _boot_of(robot: RobotState) -> str | None:
    """The boot that the robot spoke of last."""
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
