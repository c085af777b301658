"""Carries the orders of a STOP machine, on all transports at once.

Each send is a task of its own: nothing is awaited before a STOP's first byte is on its
way, and a failure of one transport holds up no other.
"""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from functools import partial

from iveg.domain.errors import HopError
from iveg.domain.observations import Instant
from iveg.domain.stop import (
    Effect,
    SendOnce,
    SendStop,
    SetDesiredState,
    StopMachine,
)
from iveg.domain.transports import FIWARE, TransportId
from iveg.vital.core import Core

_log = logging.getLogger(__name__)
CameBack = Callable[[StopMachine, list[Effect], Instant], None]
_Send = Callable[[], Coroutine[None, None, None]]


class OrderSender:
    """Sends STOPs, releases, resumes and desired states, each in its own task.

    Args:
        core: Of its ports the transports, the fleet and the journal.
        came_back: Told how each send went.
    """

    def __init__(self, core: Core, came_back: CameBack) -> None:
        self._transports = {way.id: port for way, port in core.ports.transports.items()}
        self._fleet, self._journal = core.ports.fleet, core.ports.journal
        self._event_log, self._clock = core.event_log, core.ports.clock
        self._health_monitor = core.health_monitor
        self._came_back = came_back
        self._desired_states: dict[str, SetDesiredState] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def send_stop(self, machine: StopMachine, effect: SendStop) -> None:
        """Begin to send a STOP on one transport; the result comes back later."""
        port, order = self._transports[effect.transport], effect.command_id
        send = partial(port.stop, effect.robot_id, effect.hold_id, order[-6:])
        self._start_attempt(machine, "stop", effect.transport, order, send)

    def send_once(self, machine: StopMachine, effect: SendOnce) -> None:
        """Begin to send a release or resume; the results come back later."""
        name = f"{effect.attempt.command.kind}-{machine.robot_id}"
        self.start(self._send_once(machine, effect), name)

    def set_desired_state(self, effect: SetDesiredState) -> None:
        """Begin to publish a robot's desired state."""
        self._desired_states[effect.robot_id] = effect
        self._start_desired_state(effect)

    def publish_desired_states(self) -> None:
        """Publish every desired state again: the broker is connected."""
        for wanted in self._desired_states.values():
            self._start_desired_state(wanted)

    def start(self, work: Coroutine[None, None, None], name: str) -> None:
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

    async def _send_once(self, machine: StopMachine, effect: SendOnce) -> None:
        """Send once, after the audit row is on disk."""
        await asyncio.gather(
            self._event_log.flushed(), self._note_named(machine, effect)
        )
        command, attempt = effect.attempt.command, effect.attempt
        if machine.once is None or machine.once.command_id != command.command_id:
            # The disk took so long that a STOP has come, or taken its place.
            return
        challenge, order = attempt.challenge, command.command_id
        for transport, way in command.transports.items():
            if way == "off":
                continue
            port = self._transports[transport]
            if command.kind == "resume":
                send = partial(port.resume, machine.robot_id, challenge, order)
            else:
                names = machine.robot_id, attempt.ids
                send = partial(port.release, *names, challenge, order)
            self._start_attempt(machine, command.kind, transport, order, send)

    async def _note_named(self, machine: StopMachine, effect: SendOnce) -> None:
        """Write down which STOPs a release names: none is asserted as new again."""
        if machine.hold_id is None or not effect.ours:
            return
        by = "iveg" if machine.stop is None else machine.stop.requesters[0]
        await self._journal.log_release(
            machine.robot_id,
            machine.hold_id,
            effect.ours,
            effect.attempt.challenge,
            by,
            self._clock(),
        )

    def _start_attempt(
        self,
        machine: StopMachine,
        kind: str,
        transport: TransportId,
        command_id: str,
        send: _Send,
    ) -> None:
        work = self._attempt(machine, transport, command_id, send)
        self.start(work, f"{kind}-{transport}-{machine.robot_id}")

    async def _attempt(
        self,
        machine: StopMachine,
        transport: TransportId,
        command_id: str,
        send: _Send,
    ) -> None:
        """Send, and report the result to the machine, whatever went wrong.

        A transport whose failure was not reported would count as busy for ever.
        """
        ok, left = False, self._clock()
        try:
            await send()
            ok = True
        except HopError as error:
            _log.info("order by transport %s: %s", transport, error)
        finally:
            at = self._clock()
            # What lies behind Orion may be known to pass nothing on.
            doubtful = transport == FIWARE.id and self._health_monitor.is_cut(at)
            effects = machine.sent(
                transport, command_id, at, ok=ok, doubtful=doubtful, left=left
            )
            self._came_back(machine, effects, at)

    def _start_desired_state(self, wanted: SetDesiredState) -> None:
        self.start(self._set_desired_state(wanted), f"desired-{wanted.robot_id}")

    async def _set_desired_state(self, wanted: SetDesiredState) -> None:
        try:
            await self._fleet.set_desired_state(
                wanted.robot_id, wanted.desired, wanted.ids
            )
        except HopError as error:
            # Published again when the broker is back (``publish_desired_states``).
            _log.info("desired state of %s not set: %s", wanted.robot_id, error)
