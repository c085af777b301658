"""Revoking a robot: STOP first, then it is heard no more, on any transport.

::

    admitted ──revoke──> STOP ──standing, or 3 s──> revoked ──allow──> admitted, held

What comes from a revoked robot is counted and dropped before anything looks at it, so
its age runs out and it is never clear.  STOP still goes to it: it may be connected.
"""

import asyncio
from collections.abc import Awaitable, Callable, Mapping

from iveg.domain.errors import HopError
from iveg.domain.events import LogEvent
from iveg.domain.revocation import BrokerTold, Revocation
from iveg.domain.robot_state import RobotState
from iveg.domain.world import World
from iveg.pipeline import topics
from iveg.pipeline.command import Commander
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.ports import BrokerAccess, ChoiceStore, Clock

Pause = Callable[[float], Awaitable[None]]
STOOD_WITHIN_S = 3.0
"""So long a standstill is waited for: with all the rest less than 5 s."""
_LOOK_EVERY_S = 0.05


class Revocations:
    """Revokes robots and allows them again.

    Args:
        world: The robots.
        commander: Stops them.
        store: Keeps it for the next start of iVeg.
        access: Has the broker follow.
        event_log: Keeps the record.
        clock: The time.
        kept: What the last run left, by robot.
        pause: Waits so many seconds.
    """

    def __init__(
        self,
        world: World,
        commander: Commander,
        store: ChoiceStore[Mapping[str, Revocation]],
        access: BrokerAccess,
        event_log: EventLog,
        clock: Clock,
        kept: Mapping[str, Revocation],
        pause: Pause = asyncio.sleep,
    ) -> None:
        self._world = world
        self._commander = commander
        self._store = store
        self._access = access
        self._event_log = event_log
        self._clock = clock
        self._pause = pause
        self._one_by_one = asyncio.Lock()
        for robot_id, word in kept.items():
            if robot_id in world.robots:
                world.robots[robot_id].revoked = word

    async def revoke(self, robot_id: str, by: str) -> tuple[RobotState, BrokerTold]:
        """Stop a robot, then hear it no more; again: the same.

        Raises:
            UnknownRobotError: not in the fleet.
            HopError: it is in force, but a restart would forget it.
        """
        robot = self._world.robot(robot_id)
        async with self._one_by_one:
            if robot.revoked is None:
                stood = await self._stopped(robot_id, by)
                # At once: a disk that is full must not keep it connected.
                robot.revoked = Revocation(by, self._clock().wall, stood)
                key = "log.robot_revoked" if stood else "log.robot_revoked_unconfirmed"
                self._tell(key, robot_id, by)
            answer = await self._tell_broker(robot_id, admitted=False)
            await self._save()
        return robot, answer

    async def allow(self, robot_id: str, by: str) -> tuple[RobotState, BrokerTold]:
        """Hear a robot again; it stays held until people release it.

        Raises:
            UnknownRobotError: not in the fleet.
            HopError: it could not be written down; it stays revoked.
        """
        robot = self._world.robot(robot_id)
        async with self._one_by_one:
            before, robot.revoked = robot.revoked, None
            try:
                await self._save()
            except HopError:
                robot.revoked = before
                raise
            if before is not None:
                self._tell("log.robot_allowed", robot_id, by)
            answer = await self._tell_broker(robot_id, admitted=True)
        return robot, answer

    async def _stopped(self, robot_id: str, by: str) -> bool:
        """STOP it, standing or not: who stands may drive on; whether it stands."""
        await self._commander.stop([robot_id], by, self._clock())
        machine, began = self._commander.machine(robot_id), self._clock().mono
        while machine.state != "STANDING":
            if self._clock().mono - began >= STOOD_WITHIN_S:
                return False
            await self._pause(_LOOK_EVERY_S)
        return True

    async def _tell_broker(self, robot_id: str, *, admitted: bool) -> BrokerTold:
        try:
            answer: BrokerTold = await self._access.change(robot_id, admitted=admitted)
        except HopError as error:
            slots = {"robot": robot_id, "reason": str(error)[:200]}
            event = LogEvent("system", "log.broker_access_failed", slots, robot_id)
            self._event_log.log(event, self._clock())
            return "failed"
        return answer

    async def _save(self) -> None:
        words = {one.robot_id: one.revoked for one in self._world.robots.values()}
        await self._store.save({name: one for name, one in words.items() if one})

    def _tell(self, key: str, robot_id: str, by: str) -> None:
        slots = {"robot": robot_id, "by": by}
        self._event_log.log(LogEvent("system", key, slots, robot_id), self._clock())
        self._event_log.changed(topics.ROBOT.of(robot_id))
