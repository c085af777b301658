"""Carries what a STOP machine wants sent, on both roads at once.

Each send is a task of its own: nothing is awaited before its first byte is on its way,
and nothing that fails on one road holds up the other.
"""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any

from iveg.domain.errors import HopError
from iveg.domain.observations import Instant
from iveg.domain.stop import (
    Effect,
    SendOnce,
    SendRoad,
    SendStop,
    SetLevel,
    StopMachine,
)
from iveg.pipeline.minutes import Minutes
from iveg.pipeline.ports import Clock, ContextBroker, Fleet

_log = logging.getLogger(__name__)
CameBack = Callable[[StopMachine, list[Effect], Instant], None]


class Sender:
    """The way out: STOPs, releases, resumes and levels, each in its own task."""

    def __init__(
        self,
        fleet: Fleet,
        broker: ContextBroker,
        minutes: Minutes,
        clock: Clock,
        came_back: CameBack,
    ) -> None:
        self._fleet = fleet
        self._broker = broker
        self._minutes = minutes
        self._clock = clock
        self._came_back = came_back
        self._levels: dict[str, SetLevel] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def send(
        self, machine: StopMachine, effect: SendStop | SendOnce | SetLevel
    ) -> None:
        """Begin to send; how it went comes back later."""
        match effect:
            case SendStop():
                name = f"stop-{effect.road}-{effect.robot_id}"
                self.start(self._send_stop(machine, effect), name)
            case SendOnce():
                name = f"{effect.kind}-{effect.robot_id}"
                self.start(self._send_once(machine, effect), name)
            case SetLevel():
                self._levels[effect.robot_id] = effect
                self._start_level(effect)

    def levels_again(self) -> None:
        """The broker is there (again): it must hold every level."""
        for level in self._levels.values():
            self._start_level(level)

    def start(self, work: Coroutine[Any, Any, None], name: str) -> None:
        """Do this without waiting for it; a failure is logged."""
        task = asyncio.get_running_loop().create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and task.exception() is not None:
            _log.error("%s failed", task.get_name(), exc_info=task.exception())

    async def close(self) -> None:
        """End what is being sent."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # --- the roads ----------------------------------------------------------------

    async def _send_stop(self, machine: StopMachine, effect: SendStop) -> None:
        port: Fleet | ContextBroker = (
            self._fleet if effect.road == "direct" else self._broker
        )
        by = "iveg"
        if machine.stop is not None:
            by = machine.stop.command_id[-6:]
        sending = port.stop(effect.robot_id, effect.hold_id, by)
        await self._attempt(machine, effect.road, effect.hold_id, sending)

    async def _send_once(self, machine: StopMachine, effect: SendOnce) -> None:
        """Once, and never without a trace: the audit row is on disk before it goes."""
        await self._minutes.secured()
        if machine.once is None or machine.once.command_id != effect.command_id:
            # The disk took so long that a STOP has come, or taken its place.
            return
        if effect.kind == "release":
            sending = self._broker.release(
                effect.robot_id, effect.ids, effect.challenge
            )
        else:
            sending = self._broker.resume(effect.robot_id, effect.challenge)
        await self._attempt(machine, "fiware", effect.command_id, sending)

    async def _attempt(
        self,
        machine: StopMachine,
        road: SendRoad,
        command_id: str,
        sending: Coroutine[Any, Any, None],
    ) -> None:
        """Send and tell the machine how it went, whatever went wrong.

        A road whose failure stayed untold would count as busy for ever.
        """
        ok = False
        try:
            await sending
            ok = True
        except HopError as error:
            _log.info("STOP road %s: %s", road, error)
        finally:
            at = self._clock()
            self._came_back(machine, machine.sent(road, command_id, at, ok=ok), at)

    def _start_level(self, level: SetLevel) -> None:
        self.start(self._set_level(level), f"level-{level.robot_id}")

    async def _set_level(self, level: SetLevel) -> None:
        try:
            await self._fleet.set_level(level.robot_id, level.desired, level.ids)
        except HopError as error:
            # Published again when the broker is back (``levels_again``).
            _log.info("level of %s not set: %s", level.robot_id, error)
