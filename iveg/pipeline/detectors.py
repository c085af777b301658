"""Detectors out of service by an operator's word: on disk first, then in force, logged.

It is the only way to lift a requirement of the claim "clear" (docs/safety.md, "Clear"),
and it ends with the robot's next boot at the latest.
"""

import asyncio
from collections.abc import Mapping

from iveg.domain.detector import OutOfService
from iveg.domain.events import LogEvent
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.world import World
from iveg.pipeline import topics
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.ports import ChoiceStore


class Detectors:
    """Takes detectors out of service and puts them back.

    Args:
        world: Robots whose detectors they are.
        store: Keeps it for the next start of iVeg.
        event_log: Keeps the record.
        kept: What the last run left, by robot.
    """

    def __init__(
        self,
        world: World,
        store: ChoiceStore[Mapping[str, OutOfService]],
        event_log: EventLog,
        kept: Mapping[str, OutOfService],
    ) -> None:
        self._world = world
        self._store = store
        self._event_log = event_log
        self._one_by_one = asyncio.Lock()
        for robot_id, word in kept.items():
            if robot_id in world.robots:
                world.robots[robot_id].detector.out_of_service = word

    async def set_in_service(
        self, robot_id: str, by: str, at: Instant, *, in_service: bool
    ) -> RobotState:
        """Put a detector in service, or take it out; returns its robot.

        Raises:
            UnknownRobotError: not in the fleet.
            HopError: it could not be written down; nothing has changed.
        """
        robot = self._world.robot(robot_id)
        async with self._one_by_one:
            word = None if in_service else OutOfService(by, at.wall, _boot_of(robot))
            out = self._out_of_service() | {robot_id: word}
            await self._store.save({name: one for name, one in out.items() if one})
            robot.detector.out_of_service = word
        key = "log.detector_in" if in_service else "log.detector_out"
        slots = {"robot": robot_id, "by": by}
        self._event_log.log(LogEvent("system", key, slots, robot_id), at)
        self._event_log.changed(topics.ROBOT.of(robot_id))
        return robot

    def _out_of_service(self) -> dict[str, OutOfService | None]:
        robots = self._world.robots.values()
        return {robot.robot_id: robot.detector.out_of_service for robot in robots}


def _boot_of(robot: RobotState) -> str | None:
    """The boot that the robot spoke of last."""
    newest = robot.odometry or robot.safety or robot.frame
    return None if newest is None else newest.origin.boot
