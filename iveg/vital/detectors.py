"""Words of operators on detectors: on disk first, then in force, logged.

A detector out of service lifts a requirement of the claim "clear" (docs/safety.md,
"Clear"), as nothing else does; that ends with the robot's next boot at the latest.  An
answer says what an unknown word stands for.
"""

import asyncio
from collections.abc import Mapping

from iveg.domain.detector import OutOfService
from iveg.domain.errors import UnknownNameError
from iveg.domain.events import LogEvent
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.words import WordAnswer
from iveg.domain.world import World
from iveg.vital import topics
from iveg.vital.event_log import EventLog
from iveg.vital.ports import ChoiceStore


class Detectors:
    """Takes detectors out of service and puts them back, and answers their words.

    Args:
        world: Robots whose detectors they are.
        store: Keeps who is out of service for the next start of iVeg.
        words: Keeps the answers.
        event_log: Keeps the record.
        kept: What the last run left, by robot.
        answers: The same, of words.
    """

    def __init__(
        self,
        world: World,
        store: ChoiceStore[Mapping[str, OutOfService]],
        words: ChoiceStore[Mapping[str, WordAnswer]],
        event_log: EventLog,
        kept: Mapping[str, OutOfService],
        answers: Mapping[str, WordAnswer],
    ) -> None:
        self._world, self._event_log = world, event_log
        self._store, self._words = store, words
        self._one_by_one = asyncio.Lock()
        for robot_id, word in kept.items():
            if robot_id in world.robots:
                world.robots[robot_id].detector.out_of_service = word
        for answer in answers.values():
            world.word_answers.add(answer)

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
            await self._store.save({name: one for name, one in out.items() if one})
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
            await self._words.save({"/".join(key): one for key, one in every.items()})
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
