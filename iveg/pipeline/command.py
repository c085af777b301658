"""STOP, release and resume: from a person's hand to the robot's own word.

The machines of ``domain/stop`` decide; this module performs what they ask for on both
roads at once.  Nothing is awaited before the first byte is on its way, and nothing
that fails on one road holds up the other.
"""

import asyncio
import logging
from collections.abc import Coroutine, Iterable, Mapping
from dataclasses import replace
from typing import Any, Literal

from iveg.domain.alarms import Condition
from iveg.domain.errors import HopError, UnknownRobotError
from iveg.domain.events import LogEvent, Slot
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
    Command,
    Effect,
    Press,
    SendOnce,
    SendRoad,
    SendStop,
    SetLevel,
    StopMachine,
)
from iveg.domain.stop.drills import Drills
from iveg.pipeline.minutes import Minutes
from iveg.pipeline.ports import Clock, ContextBroker, Fleet, Ids, Journal
from iveg.pipeline.presses import Presses
from iveg.pipeline.publish import Hub

_log = logging.getLogger(__name__)
_KEPT = 200
_PLAIN = Press()

_JOURNALLED: Mapping[str, Literal["stopped", "run"]] = {
    "ready": "run",
    "adopted": "stopped",
    "reasserted": "stopped",
    "moved": "stopped",
    "release_unconfirmed": "stopped",
}
"""Changes of what is wanted that no person's call has written down already."""
_ALARMS = {
    "UNCONFIRMED": "alert.stop_unconfirmed",
    "STILL_MOVING": "alert.stop_still_moving",
}


class Commander:
    """Keeps one STOP machine a robot and does what they ask."""

    def __init__(
        self,
        robots: Iterable[str],
        fleet: Fleet,
        broker: ContextBroker,
        journal: Journal,
        minutes: Minutes,
        hub: Hub,
        new_id: Ids,
        clock: Clock,
        *,
        direct: bool = True,
        drills: Drills | None = None,
    ) -> None:
        self.machines: Mapping[str, StopMachine] = {
            robot_id: StopMachine(robot_id, direct=direct) for robot_id in robots
        }
        self.commands: dict[str, Command] = {}
        self.drills = drills or Drills()
        self._presses = Presses()
        self._levels: dict[str, SetLevel] = {}
        self._fleet = fleet
        self._broker = broker
        self._journal = journal
        self._minutes = minutes
        self._hub = hub
        self._new_id = new_id
        self._clock = clock
        self._tasks: set[asyncio.Task[None]] = set()

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
        self, robots: Iterable[str], by: str, at: Instant, press: Press = _PLAIN
    ) -> list[Command]:
        """STOP these robots, in parallel; returns when it is sent and on disk."""
        machines = [self.machine(robot_id) for robot_id in robots]
        pressed = [self._press(machine, by, at, press) for machine in machines]
        await self._write_down(pressed, by, at)
        return pressed

    def _press(
        self, machine: StopMachine, by: str, at: Instant, press: Press
    ) -> Command:
        """Begin or join an episode; a press that came before is the same press."""
        known = self._presses.find(by, press, machine.robot_id, at)
        earlier = None if known is None else self.commands.get(known)
        if earlier is not None and not machine.follows(earlier):
            # That press has had its life: a late copy of it is no new wish.
            return earlier
        self._perform(machine, machine.press(by, at, self._new_id(), press=press), at)
        assert machine.stop is not None  # noqa: S101 - a press begins an episode
        command_id = machine.stop.command_id
        self._presses.note(by, press, machine.robot_id, command_id, at)
        return machine.stop

    async def _write_down(
        self, pressed: Iterable[Command], by: str, at: Instant
    ) -> None:
        """What is wanted and who wanted it, on disk before it counts as accepted."""
        # Let every send reach its socket before the disk is asked for anything.
        await asyncio.sleep(0)
        stands = [one for one in pressed if self.machine(one.robot_id).follows(one)]
        await asyncio.gather(
            self._minutes.secured(),
            *(
                self._journal.wanted(one.robot_id, "stopped", one.command_id, by, at)
                for one in stands
            ),
        )

    async def drill(
        self, robot_id: str, by: str, at: Instant, press: Press = _PLAIN
    ) -> Command:
        """Prove that STOP works: a real STOP, of a robot that hardly moves.

        Raises:
            CommandRefusedError: stopped already, faster than a crawl, or unheard.
        """
        machine = self.machine(robot_id)
        press = replace(press, drill=True)
        self._perform(machine, machine.drill(by, at, self._new_id(), press), at)
        assert machine.stop is not None  # noqa: S101 - a drill begins an episode
        drilled = machine.stop
        await self._write_down([drilled], by, at)
        return drilled

    async def release(
        self, robot_id: str, seen: Iterable[str], by: str, at: Instant
    ) -> Command:
        """Lift the holds that a person saw.

        Raises:
            CommandRefusedError: it must not happen now.
        """
        machine = self.machine(robot_id)
        effects = machine.release(by, seen, at, self._new_id())
        return self._once(machine, effects, at)

    async def resume(self, robot_id: str, by: str, at: Instant) -> Command:
        """Let a released robot drive.

        Raises:
            CommandRefusedError: it must not happen now.
        """
        machine = self.machine(robot_id)
        return self._once(machine, machine.resume(by, at, self._new_id()), at)

    def _once(
        self, machine: StopMachine, effects: list[Effect], at: Instant
    ) -> Command:
        self._perform(machine, effects, at)
        assert machine.once is not None  # noqa: S101 - just begun
        return machine.once

    # --- what comes back ----------------------------------------------------------

    def take(self, received: Received) -> None:
        """Show a robot's machine what arrived; only what is new gets here."""
        observation, at = received.observation, received.at
        machine = self.machines.get(getattr(observation, "robot_id", ""))
        if machine is None:
            return
        effects: list[Effect] = []
        match observation:
            case SafetyReport():
                effects = machine.reported(
                    observation, at, received.road, self._new_id()
                )
            case CommandAnswer():
                effects = machine.answered(observation, at, received.road)
            case Odometry():
                twist = observation.twist
                effects = machine.odometry(
                    twist.linear_x, twist.angular_z, at, self._new_id()
                )
        self._perform(machine, effects, at)

    def tick(self, now: Instant) -> None:
        """Deadlines and what must be sent again."""
        for machine in self.machines.values():
            self._perform(machine, machine.tick(now, self._new_id()), now)

    def restore(self, wanted: Mapping[str, str], now: Instant) -> None:
        """After a restart: every robot that was to stand is stopped again, newly."""
        for robot_id, by in wanted.items():
            machine = self.machines.get(robot_id)
            if machine is None:
                continue
            effects = machine.press(by, now, self._new_id(), key="reasserted")
            self._perform(machine, effects, now)

    def close_earlier(self, left: Iterable[CommandRecord], now: Instant) -> None:
        """Close the rows that an earlier run left open; nobody follows them any more.

        A STOP whose robot was stopped again says under which name, and everything else
        that it is not known how it ended.
        """
        for row in left:
            if row.command_id in self.commands:
                continue
            machine = self.machines.get(row.robot_id)
            heir = None
            # One that waited for its resume had been released: nothing took its place.
            stood = row.kind == "stop" and row.state != "READY"
            if machine is not None and machine.wants_stop and stood:
                heir = machine.hold_id
            self._minutes.left_over(row, heir, now)
        self._start(self._minutes.secured(), "audit-earlier")

    def broker_back(self) -> None:
        """The broker is there (again): it must hold every level."""
        for level in self._levels.values():
            self._start(self._set_level(level), f"level-{level.robot_id}")

    def conditions(self, now: Instant) -> Iterable[Condition]:
        """What is wrong with STOP."""
        yield from self.drills.conditions(now)
        for robot_id, machine in self.machines.items():
            key = _ALARMS.get(machine.state)
            if key is not None:
                age = 0.0
                if machine.stop is not None:
                    age = now.mono - machine.stop.times.requested.mono
                slots: dict[str, Slot] = {"robot": robot_id, "age": round(age, 1)}
                yield Condition("P1", key, robot_id, robot_id, slots)

    # --- effects ------------------------------------------------------------------

    def _perform(
        self, machine: StopMachine, effects: Iterable[Effect], at: Instant
    ) -> None:
        for effect in effects:
            match effect:
                case SendStop():
                    self._start(
                        self._send_stop(machine, effect),
                        f"stop-{effect.road}-{effect.robot_id}",
                    )
                case SendOnce():
                    self._start(
                        self._send_once(machine, effect),
                        f"{effect.kind}-{effect.robot_id}",
                    )
                case SetLevel():
                    self._levels[effect.robot_id] = effect
                    self._start(self._set_level(effect), f"level-{effect.robot_id}")
                case Changed():
                    self._tell(machine, effect, at)
                    self._start(self._minutes.secured(), f"audit-{machine.robot_id}")
                case Closed():
                    self._minutes.closed(effect, at)

    def _tell(self, machine: StopMachine, changed: Changed, at: Instant) -> None:
        command = self._command_of(machine, changed)
        if command is not None:
            self.commands[command.command_id] = command
            while len(self.commands) > _KEPT:
                del self.commands[next(iter(self.commands))]
            self._minutes.command(command, changed, at)
            if command.drill and changed.key == "standing":
                self.drills.passed(command.robot_id, command.times.requested.wall)
            if changed.key in ("ready", "running"):
                self._note_end(command, at)
        desired = _JOURNALLED.get(changed.key)
        if desired is not None:
            by = "iveg" if command is None else command.requesters[0]
            self._start(
                self._journal.wanted(
                    machine.robot_id, desired, machine.hold_id, by, at
                ),
                f"journal-{machine.robot_id}",
            )
        self._log_line(machine, command, changed, at)
        self._hub.changed(f"robots/{machine.robot_id}")

    def _note_end(self, command: Command, at: Instant) -> None:
        """A release or resume that came true has moved the STOP on, too."""
        for earlier in reversed(self.commands.values()):
            if earlier.robot_id == command.robot_id and earlier.kind == "stop":
                if earlier is not command:
                    self._minutes.command(earlier, None, at)
                return

    def _command_of(self, machine: StopMachine, changed: Changed) -> Command | None:
        for command in (machine.once, machine.stop):
            if command is not None and command.command_id == changed.command_id:
                return command
        return self.commands.get(changed.command_id)

    def _log_line(
        self,
        machine: StopMachine,
        command: Command | None,
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
        self._minutes.log(
            LogEvent("command", f"log.stop.{changed.key}", slots, machine.robot_id), at
        )

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
            self._perform(machine, machine.sent(road, command_id, at, ok=ok), at)

    async def _set_level(self, level: SetLevel) -> None:
        try:
            await self._fleet.set_level(level.robot_id, level.desired, level.ids)
        except HopError as error:
            # Published again when the broker is back (``broker_back``).
            _log.info("level of %s not set: %s", level.robot_id, error)

    def _start(self, work: Coroutine[Any, Any, None], name: str) -> None:
        task = asyncio.get_running_loop().create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and task.exception() is not None:
            _log.error("%s failed", task.get_name(), exc_info=task.exception())

    async def close(self) -> None:
        """Let what is being sent end."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
