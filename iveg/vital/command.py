"""STOP, release and resume: from a person's press to the robot's own answer.

The machines of ``domain/stop`` decide, ``OrderSender`` carries their orders on all
transports at once, and ``Commander`` stands between the two and informs people, disk
and browsers of each step.
"""

import asyncio
import logging
from collections import Counter, OrderedDict
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from functools import partial
from typing import Literal

from iveg.domain.errors import HopError, UnknownRobotError
from iveg.domain.events import Condition, LogEvent, Slot
from iveg.domain.motion import UNMOVED, Motion
from iveg.domain.observations import (
    CommandAnswer,
    Instant,
    Odometry,
    Received,
    SafetyReport,
)
from iveg.domain.records import CommandRecord
from iveg.domain.stop import (
    Changed,
    Closed,
    DesiredRecord,
    Effect,
    FollowedCommand,
    OffTable,
    Press,
    SendOnce,
    SendStop,
    SetDesiredState,
    StopMachine,
)
from iveg.domain.stop.commands import PLAIN
from iveg.domain.stop.machine import stop_conditions
from iveg.domain.transports import FIWARE, TransportId
from iveg.vital import topics
from iveg.vital.core import Core

_log = logging.getLogger(__name__)
CameBack = Callable[[StopMachine, list[Effect], Instant], None]
_Send = Callable[[], Coroutine[None, None, None]]
_KEPT = 200
REMEMBERED_S = 60.0
"""Time for which a press is known by its id (s)."""
_MOST_PRESSES = 4096

_JOURNALLED: Mapping[str, Literal["stopped", "run"]] = {
    "ready": "run",
    "adopted": "stopped",
    "reasserted": "stopped",
    "moved": "stopped",
    "release_unconfirmed": "stopped",
}
"""Changes of the desired state that no person's call has written to the journal."""


class Presses:
    """The command of each press, for a while: one press is one STOP.

    A page sends a press over HTTP and over its WebSocket and repeats it until it is
    taken.  A press that comes back later counts as new, because a STOP too many is
    better than a STOP too few.
    """

    def __init__(self) -> None:
        self._known: OrderedDict[tuple[str, str, str], tuple[float, str]] = (
            OrderedDict()
        )

    def find(self, by: str, press: Press, robot_id: str, at: Instant) -> str | None:
        """Id of the command that this press has begun; None for a new press."""
        if press.press_id is None:
            return None
        since, command_id = self._known.get(
            (by, press.press_id, robot_id), (float("-inf"), "")
        )
        return command_id if at.mono - since <= REMEMBERED_S else None

    def note(
        self, by: str, press: Press, robot_id: str, command_id: str, at: Instant
    ) -> None:
        """Remember the command of this press."""
        if press.press_id is None:
            return
        self._known[by, press.press_id, robot_id] = at.mono, command_id
        while len(self._known) > _MOST_PRESSES:
            self._known.popitem(last=False)


class OrderSender:
    """Sends STOPs, releases, resumes and desired states, each in its own task.

    Nothing is awaited before a STOP's first byte is on its way, and a failure of one
    transport holds up no other.

    Args:
        core: It has the transports, the fleet and the journal.
        came_back: Called with the effects of each send that ended.
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
        work = self._attempt(machine, effect.transport, order, send)
        self.start(work, f"stop-{effect.transport}-{machine.robot_id}")

    def send_once(self, machine: StopMachine, effect: SendOnce) -> None:
        """Begin to send a release or resume; the results come back later."""
        name = f"{effect.attempt.command.kind}-{machine.robot_id}"
        self.start(self._send_once(machine, effect), name)

    def set_desired_state(self, effect: SetDesiredState) -> None:
        """Begin to publish a robot's desired state."""
        self._desired_states[effect.robot_id] = effect
        self.start(self._set_desired_state(effect), f"desired-{effect.robot_id}")

    def publish_desired_states(self) -> None:
        """Publish every desired state again: the broker is connected."""
        for state in self._desired_states.values():
            self.set_desired_state(state)

    def start(self, work: Coroutine[None, None, None], name: str) -> None:
        """Run this as a task; a failure is logged."""
        task = asyncio.get_running_loop().create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and task.exception() is not None:
            _log.error("task %s has failed", task.get_name(), exc_info=task.exception())

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
        if machine.order is None or machine.order.command_id != command.command_id:
            # While the disk wrote, a STOP has come or taken the order's place.
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
            work = self._attempt(machine, transport, order, send)
            self.start(work, f"{command.kind}-{transport}-{machine.robot_id}")

    async def _note_named(self, machine: StopMachine, effect: SendOnce) -> None:
        """Journal the STOPs that a release names: none may be asserted again as new."""
        if machine.hold_id is None or not effect.ours:
            return
        requester = "iveg" if machine.stop is None else machine.stop.requesters[0]
        await self._journal.log_desired(
            machine.robot_id,
            "stopped",
            machine.hold_id,
            requester,
            self._clock(),
            named=effect.ours,
            challenge=effect.attempt.challenge,
        )

    async def _attempt(
        self,
        machine: StopMachine,
        transport: TransportId,
        command_id: str,
        send: _Send,
    ) -> None:
        """Send, and report the result to the machine, any error included.

        A transport whose failure was not reported would count as busy for ever.
        """
        ok, sent_at = False, self._clock()
        try:
            await send()
            ok = True
        except HopError as error:
            _log.info("order by transport %s: %s", transport, error)
        finally:
            at = self._clock()
            # Orion may take an order although the way behind it is known to be cut.
            doubtful = transport == FIWARE.id and self._health_monitor.is_cut(at)
            effects = machine.sent(
                transport, command_id, at, ok=ok, doubtful=doubtful, handed_over=sent_at
            )
            self._came_back(machine, effects, at)

    async def _set_desired_state(self, wanted: SetDesiredState) -> None:
        try:
            await self._fleet.set_desired_state(
                wanted.robot_id, wanted.desired, wanted.ids
            )
        except HopError as error:
            # Published again when the broker is back (``publish_desired_states``).
            _log.info("desired state of %s not set: %s", wanted.robot_id, error)


class Commander:
    """Keeps one STOP machine for each robot and carries out its effects.

    Attributes:
        machines: STOP machine of each robot, by its id.
        commands: The newest commands, by id, as they stand.
    """

    def __init__(self, core: Core) -> None:
        self.machines: Mapping[str, StopMachine] = {
            robot_id: StopMachine(robot_id, core.ports.transports)
            for robot_id in core.world.robots
        }
        self.commands: dict[str, FollowedCommand] = {}
        self.counters: Counter[str] = Counter()
        self._presses = Presses()
        self._sender = OrderSender(core, self._came_back)
        self._journal, self._event_log = core.ports.journal, core.event_log
        self._new_id = core.ports.new_id

    def machine(self, robot_id: str) -> StopMachine:
        """One robot's machine.

        Raises:
            UnknownRobotError: not in the fleet.
        """
        try:
            return self.machines[robot_id]
        except KeyError:
            raise UnknownRobotError(robot_id) from None

    # --- people -------------------------------------------------------------------

    async def stop(
        self, robots: Iterable[str], by: str, at: Instant, press: Press = PLAIN
    ) -> list[FollowedCommand]:
        """STOP these robots, in parallel; returns when it is sent and on disk."""
        machines = [self.machine(robot_id) for robot_id in robots]
        pressed = [self._press(machine, by, at, press) for machine in machines]
        return await self._write_down(pressed, by, at)

    def _press(
        self, machine: StopMachine, by: str, at: Instant, press: Press
    ) -> FollowedCommand:
        """Begin or join an episode; a repeated press is the same press."""
        known = self._presses.find(by, press, machine.robot_id, at)
        earlier = None if known is None else self.commands.get(known)
        if earlier is not None and not machine.follows(earlier):
            # The command of that press is over: a late copy of it is no new press.
            return earlier
        self._perform(machine, machine.press(by, at, self._new_id(), press=press), at)
        assert machine.stop is not None  # noqa: S101 - a press begins an episode
        self._presses.note(by, press, machine.robot_id, machine.stop.command_id, at)
        return machine.stop

    async def _write_down(
        self, pressed: Sequence[FollowedCommand], by: str, at: Instant
    ) -> list[FollowedCommand]:
        """Write the desired state and its author to disk before the press is accepted.

        Returns:
            The commands as they are by then.
        """
        # Let every send reach its socket before the disk is used.
        await asyncio.sleep(0)
        stands = [stop for stop in pressed if self.machine(stop.robot_id).follows(stop)]
        await asyncio.gather(
            self._event_log.flushed(),
            *(
                self._journal.log_desired(
                    stop.robot_id, "stopped", stop.hold_id, by, at
                )
                for stop in stands
            ),
        )
        return [self.commands.get(stop.command_id, stop) for stop in pressed]

    async def release(
        self, robot_id: str, seen: Iterable[str], by: str, at: Instant
    ) -> FollowedCommand:
        """Lift the holds that a person saw.

        Raises:
            CommandRefusedError: it must not happen now.
        """
        machine = self.machine(robot_id)
        effects = machine.release(by, seen, at, self._new_id())
        return self._once(machine, effects, at)

    async def resume(self, robot_id: str, by: str, at: Instant) -> FollowedCommand:
        """Let a released robot drive.

        Raises:
            CommandRefusedError: it must not happen now.
        """
        machine = self.machine(robot_id)
        return self._once(machine, machine.resume(by, at, self._new_id()), at)

    def _once(
        self, machine: StopMachine, effects: list[Effect], at: Instant
    ) -> FollowedCommand:
        self._perform(machine, effects, at)
        assert machine.order is not None  # noqa: S101 - just begun
        return machine.order

    # --- what comes back ----------------------------------------------------------

    def apply(
        self, received: Received, age_s: float = 0.0, motion: Motion = UNMOVED
    ) -> None:
        """Apply a new observation to the machine of its robot.

        Args:
            received: The new observation.
            age_s: Upper bound of its age at receipt (s); infinite where unknown.
            motion: Motion of the robot by all its sources.
        """
        observation, at = received.observation, received.at
        machine = self.machines.get(observation.robot_id)
        if machine is None:
            return
        effects: list[Effect] = []
        match observation:
            case SafetyReport():
                effects = machine.reported(
                    observation,
                    at,
                    received.transport,
                    self._new_id(),
                    age_s,
                    sparse=received.sparse,
                )
            case CommandAnswer():
                effects = machine.answered(
                    observation, at, received.transport, self._new_id()
                )
            case Odometry():
                effects = machine.odometry(
                    observation, at, self._new_id(), age_s, motion
                )
        self._perform(machine, effects, at)

    def tick(self, now: Instant) -> None:
        """Let time pass: deadlines, and orders that must be sent again."""
        for machine in self.machines.values():
            self._perform(machine, machine.tick(now, self._new_id()), now)

    def restore(self, wanted: Mapping[str, DesiredRecord], now: Instant) -> None:
        """Stop every robot again that was to stand before a restart."""
        for robot_id, desired in wanted.items():
            machine = self.machines.get(robot_id)
            if machine is not None:
                self._perform(
                    machine, machine.restore(desired, now, self._new_id()), now
                )

    def close_earlier(self, left: Iterable[CommandRecord], now: Instant) -> None:
        """Close the rows that an earlier run left open; nobody follows them any more.

        The row of a STOP that was asserted again names its successor; the end of every
        other row is unknown.
        """
        for row in left:
            if row.command_id in self.commands or row.kind == "goal":
                continue
            machine = self.machines.get(row.robot_id)
            heir = None
            # A STOP that waited for its resume was released: nothing took its place.
            stood = row.kind == "stop" and row.state != "READY"
            if machine is not None and machine.wants_stop and stood:
                heir = None if machine.stop is None else machine.stop.command_id
            self._event_log.left_over(row, heir, now)
        self._sender.start(self._event_log.flushed(), "audit-earlier")

    def broker_back(self) -> None:
        """Publish every desired state again: the broker is connected."""
        self._sender.publish_desired_states()

    def conditions(self, now: Instant) -> Iterable[Condition]:
        """Alert conditions of STOP."""
        return stop_conditions(self.machines.values(), now)

    # --- effects ------------------------------------------------------------------

    def _perform(
        self, machine: StopMachine, effects: Iterable[Effect], at: Instant
    ) -> None:
        for effect in effects:
            match effect:
                case SendStop():
                    self._sender.send_stop(machine, effect)
                    # A silent robot sends nothing that would bring pages the new count.
                    self._show(machine)
                case SendOnce():
                    self._sender.send_once(machine, effect)
                case SetDesiredState():
                    self._sender.set_desired_state(effect)
                case Changed():
                    self._record(machine, effect, at)
                    self._sender.start(
                        self._event_log.flushed(), f"audit-{machine.robot_id}"
                    )
                case Closed(command, key):
                    self.commands[command.command_id] = command
                    end = Changed(command.command_id, command.state, key)
                    self._event_log.command(command, end, at)
                case OffTable():
                    self._note_mistake(effect)
        # Steps replace commands by new values; the list keeps the newest.
        for command in machine.commands:
            if command.command_id in self.commands:
                self.commands[command.command_id] = command

    def _note_mistake(self, effect: OffTable) -> None:
        """A mistake of the program in STOP: logged once, counted each time."""
        self.counters["stop.off_table"] += 1
        if self.counters["stop.off_table"] == 1:
            _log.error("STOP: no step for %s", effect)

    def _came_back(
        self, machine: StopMachine, effects: list[Effect], at: Instant
    ) -> None:
        """Take the end of a send: a transport took the order, or failed."""
        self._perform(machine, effects, at)
        self._show(machine)

    def _show(self, machine: StopMachine) -> None:
        self._event_log.changed(topics.ROBOT.for_id(machine.robot_id))

    def _record(self, machine: StopMachine, changed: Changed, at: Instant) -> None:
        self.commands |= {command.command_id: command for command in changed.commands}
        while len(self.commands) > _KEPT:
            del self.commands[next(iter(self.commands))]
        command = self.commands.get(changed.command_id)
        # A confirmed release also changes the row of its STOP.
        for followed in changed.commands:
            step = changed if followed is command else None
            self._event_log.command(followed, step, at)
        desired = _JOURNALLED.get(changed.key)
        if desired is not None:
            requester = "iveg" if command is None else command.requesters[0]
            self._sender.start(
                self._journal.log_desired(
                    machine.robot_id, desired, machine.hold_id, requester, at
                ),
                f"journal-{machine.robot_id}",
            )
        self._log_line(machine, command, changed, at)
        self._show(machine)

    def _log_line(
        self,
        machine: StopMachine,
        command: FollowedCommand | None,
        changed: Changed,
        at: Instant,
    ) -> None:
        slots: dict[str, Slot] = {"robot": machine.robot_id, "why": changed.why}
        if command is not None:
            slots["by"] = ", ".join(command.requesters)
            slots["tries"] = command.tries
            took = command.standstill_ms
            if changed.key == "delivered":
                took = 1000.0 * (at.mono - command.times.requested.mono)
            if took is not None:
                slots["ms"] = round(took)
        self._event_log.log(
            LogEvent("command", f"log.stop.{changed.key}", slots, machine.robot_id), at
        )

    async def close(self) -> None:
        """Cancel the sends that are under way."""
        await self._sender.close()
