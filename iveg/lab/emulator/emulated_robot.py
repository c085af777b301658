"""One emulated robot: its rig under its own safety node, and its possible faults.

A period has three slots: drive and odometry, laser, camera.
"""

import asyncio
from contextlib import AsyncExitStack
from dataclasses import dataclass, replace
from functools import partial

from iveg.adapters import clock
from iveg.domain.geometry import REST, Twist2D
from iveg.domain.observations import Instant
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.relay import Relay
from iveg.lab.emulator.sensors import EmulatedSensors
from iveg.lab.emulator.truth import Driving, TruthLog
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld
from iveg.robot.node import RobotNode
from iveg.robot.node_settings import NodeSettings
from iveg.robot.pacing import LONGEST_STEP_S, SLOTS, in_slots

_NAVIGATION_EVERY_S = 1.0


@dataclass(frozen=True, slots=True)
class FleetSettings:
    """Settings shared by all robots of a run.

    Attributes:
        held: The boot hold is not released at the robots.
        rate_hz: Of odometry, laser and camera each.
        truth: Log of the targets really in view.
        has_equipment: Whether other equipment measures, too (``equipment``).
    """

    node: NodeSettings
    held: bool = False
    rate_hz: float = 30.0
    truth: TruthLog | None = None
    has_equipment: bool = False


class EmulatedRobot:
    """One rig and its safety node, called in their slots.

    Args:
        relay: Faulty link to the broker; None connects directly.

    Attributes:
        started: Set when fault orders are accepted.
    """

    def __init__(
        self,
        rig: RobotHardware,
        world: SimulatedWorld,
        settings: FleetSettings,
        relay: Relay | None = None,
    ) -> None:
        self.robot_id = rig.robot_id
        self.started = asyncio.Event()
        self._relay = relay
        self._rig = rig
        self._world = world
        self._settings = settings
        self._node: RobotNode
        self._node_task: asyncio.Task[None] | None = None
        self._tasks: asyncio.TaskGroup
        self._run_began = 0.0
        self._navigation_sent: tuple[str, float] = ("", -_NAVIGATION_EVERY_S)
        self._sensors = EmulatedSensors()
        self._faults = FaultOrder(robot=self.robot_id)
        self._requested = REST

    def _new_node(self, *, held: bool) -> RobotNode:
        settings = self._settings.node
        if self._relay is not None:
            settings = replace(settings, address=self._relay.address)
        return RobotNode(
            self.robot_id,
            settings,
            profile=self._rig.profile,
            drive=self._obey_gate,
            held=held,
            navigate=partial(self._rig.pursue, around=self._world),
            read_clock=self._read_clock,
        )

    async def run(self, began: float, phase: float) -> None:
        """Drive and sense until cancelled; ``began`` is when the run began."""
        self._run_began = began
        async with AsyncExitStack() as stack:
            if self._relay is not None:
                await stack.enter_async_context(self._relay)
            self._node = self._new_node(held=self._settings.held)
            if not self._settings.held:
                self._node.release_locally()
            self._tasks = await stack.enter_async_context(asyncio.TaskGroup())
            self._start_node()
            self.started.set()
            await asyncio.sleep(phase)
            await in_slots(
                1.0 / self._settings.rate_hz, (self._drive, self._scan, self._look)
            )

    # --- the slots ----------------------------------------------------------------

    def _now(self) -> float:
        return clock.mono() - self._run_began

    def _drive(self, dt: float) -> None:
        now, node = self._now(), self._node
        if self._node_task is not None:
            # While twists have no effect navigation requests zero: the gate requires
            # that before it lets the robot move again.
            requested = self._rig.requested_twist(now, self._world)
            self._requested = requested if node.may_drive else REST
            node.request_twist(self._requested)
        self._rig.move(min(dt * SLOTS, LONGEST_STEP_S))
        if self._node_task is None:
            return
        if self._faults.freeze_odometry not in (True, "silent"):
            node.sense(self._rig.odometry())
        navigation = self._rig.navigation()
        task, published_at = self._navigation_sent
        if navigation.task != task or now - published_at >= _NAVIGATION_EVERY_S:
            self._navigation_sent = (navigation.task, now)
            node.sense(navigation)
        for reading in self._sensors.due(now):
            node.sense(reading)

    def _scan(self, _: float) -> None:
        if self._node_task is not None:
            self._node.sense(self._rig.scan(self._world))

    def _look(self, _: float) -> None:
        if self._node_task is None:
            return
        self._node.sense(self._rig.detect(self._now(), self._world))
        if self._settings.truth is not None:
            factor = self._node.speed_factor if self._node.may_drive else 0.0
            driving = Driving(abs(self._requested.linear_x), factor)
            at = self._read_clock().wall
            self._settings.truth.record(self._rig, self._world, at, driving)

    def _obey_gate(self, command: Twist2D) -> None:
        """Apply the gate's command; with the fault ``deaf`` only a halt."""
        ignores = self._faults.deaf and command != REST
        self._rig.drive(self._requested if ignores else command)

    def _read_clock(self) -> Instant:
        """The robot's own clocks; the wall clock may be wrong."""
        now = clock.now()
        return Instant(now.mono, now.wall + (self._faults.clock_offset_s or 0.0))

    # --- faults -------------------------------------------------------------------

    def obey(self, order: FaultOrder) -> None:
        """Execute a fault order in the order of its fields."""
        node = self._node
        self._faults = self._faults.changed_by(order)
        if self._relay is not None:
            self._relay.radio.faults = self._faults
        self._rig.obey(order)
        if order.local_hold is not None:
            node.add_local_hold(order.local_hold)
        if order.release_locally:
            node.release_locally()
        if order.kill and self._node_task is not None:
            self._node_task.cancel()
            self._node_task = None
        if order.revive and self._node_task is None:
            self._node = self._new_node(held=True)
            self._start_node()

    def _start_node(self) -> None:
        self._node_task = self._tasks.create_task(
            self._node.run(), name=f"node-{self.robot_id}"
        )
