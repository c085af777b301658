"""Carries the orders of a STOP machine, on all transports at once.

Each send is a task of its own: nothing is awaited before a STOP's first byte is on its
way, and a failure of one transport holds up no other.
"""

import asyncio
import logging
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

from iveg.domain.errors import HopError
from iveg.domain.observations import Instant
from iveg.domain.stop import (
    Effect,
    SendOnce,
    SendStop,
    SetDesiredState,
    StopMachine,
)
from iveg.domain.transports import TransportId
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.ports import Clock, CommandPort, FleetPort, StopJournal

_log = logging.getLogger(__name__)
CameBack = Callable[[StopMachine, list[Effect], Instant], None]
IsCut = Callable[[TransportId, Instant], bool]


class OrderSender:
    """Sends STOPs, releases, resumes and desired states, each in its own task.

    Args:
        ports: The way out of each transport.
        fleet: Keeps the desired state of each robot.
        journal: Knows what a release names before it goes.
        event_log: Holds the audit row of a release before it goes.
        clock: Reads both clocks.
        came_back: Told how each send went.
        is_cut: Whether what lies behind a transport is known to pass nothing on.
    """

    def __init__(
        self,
        ports: Mapping[TransportId, CommandPort],
        fleet: FleetPort,
        journal: StopJournal,
        event_log: EventLog,
        clock: Clock,
        came_back: CameBack,
        is_cut: IsCut,
    ) -> None:
        self._ports = ports
        self._fleet = fleet
        self._journal = journal
        self._event_log = event_log
        self._clock = clock
        self._came_back = came_back
        self._is_cut = is_cut
        self._desired_states: dict[str, SetDesiredState] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def send(
        self, machine: StopMachine, effect: SendStop | SendOnce | SetDesiredState
    ) -> None:
        """Begin to send; the result comes back later."""
        match effect:
            case SendStop():
                name = f"stop-{effect.transport}-{effect.robot_id}"
                self.start(self._send_stop(machine, effect), name)
            case SendOnce():
                name = f"{effect.kind}-{effect.robot_id}"
                self.start(self._send_once(machine, effect), name)
            case SetDesiredState():
                self._desired_states[effect.robot_id] = effect
                self._start_desired_state(effect)

    def levels_again(self) -> None:
        """Publish every desired state again: the broker is connected."""
        for level in self._desired_states.values():
            self._start_desired_state(level)

    def start(self, work: Coroutine[Any, Any, None], name: str) -> None:
        """Run this as a task; a failure is logged."""
        task = asyncio.get_running_loop().create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and task.exception() is not None:
            _log.error("%s failed", task.get_name(), exc_info=task.exception())

    async def close(self) -> None:
        """Cancel the sends that are under way."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # --- the transports -----------------------------------------------------------

    async def _send_stop(self, machine: StopMachine, effect: SendStop) -> None:
        port = self._ports[effect.transport]
        by = effect.command_id[-6:]
        sending = port.stop(effect.robot_id, effect.hold_id, by)
        await self._attempt(machine, effect.transport, effect.command_id, sending)

    async def _send_once(self, machine: StopMachine, effect: SendOnce) -> None:
        """Send once, after the audit row is on disk."""
        await asyncio.gather(
            self._event_log.flushed(), self._note_named(machine, effect)
        )
        if machine.once is None or machine.once.command_id != effect.command_id:
            # The disk took so long that a STOP has come, or taken its place.
            return
        for transport in effect.transports:
            sending = self._once(self._ports[transport], effect)
            self.start(
                self._attempt(machine, transport, effect.command_id, sending),
                f"{effect.kind}-{transport}-{effect.robot_id}",
            )

    async def _note_named(self, machine: StopMachine, effect: SendOnce) -> None:
        """Write down which STOPs a release names: none is asserted as new again."""
        if machine.hold_id is None or not effect.ours:
            return
        by = "iveg" if machine.stop is None else machine.stop.requesters[0]
        await self._journal.log_release(
            effect.robot_id,
            machine.hold_id,
            effect.ours,
            effect.challenge,
            by,
            self._clock(),
        )

    @staticmethod
    def _once(port: CommandPort, effect: SendOnce) -> Coroutine[Any, Any, None]:
        robot_id, challenge = effect.robot_id, effect.challenge
        if effect.kind == "resume":
            return port.resume(robot_id, challenge, effect.command_id)
        return port.release(robot_id, effect.ids, challenge, effect.command_id)

    async def _attempt(
        self,
        machine: StopMachine,
        transport: TransportId,
        command_id: str,
        sending: Coroutine[Any, Any, None],
    ) -> None:
        """Send, and report the result to the machine, whatever went wrong.

        A transport whose failure was not reported would count as busy for ever.
        """
        ok, left = False, self._clock()
        try:
            await sending
            ok = True
        except HopError as error:
            _log.info("order by transport %s: %s", transport, error)
        finally:
            at = self._clock()
            doubtful = self._is_cut(transport, at)
            effects = machine.sent(
                transport, command_id, at, ok=ok, doubtful=doubtful, left=left
            )
            self._came_back(machine, effects, at)

    def _start_desired_state(self, level: SetDesiredState) -> None:
        self.start(self._set_desired_state(level), f"level-{level.robot_id}")

    async def _set_desired_state(self, level: SetDesiredState) -> None:
        try:
            await self._fleet.set_desired_state(
                level.robot_id, level.desired, level.ids
            )
        except HopError as error:
            # Published again when the broker is back (``levels_again``).
            _log.info("level of %s not set: %s", level.robot_id, error)
