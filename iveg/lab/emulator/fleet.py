"""Scenario in real time: each robot's rig under its own safety node, over MQTT.

A robot's period has three slots: drive and odometry, laser, camera.  The slots of the
robots are staggered, so that neither this process nor the broker gets bursts.  A late
slot is skipped, never repeated.  Climate and other equipment know of nobody: their
devices speak MQTT to the agent, as real ones would; ``iveg/data/equipment.toml`` shows
them as tiles.
"""

import asyncio
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from http import HTTPStatus
from typing import NamedTuple

import orjson

from iveg.adapters import clock
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.adapters.post_listener import post_listener
from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import REST, Twist2D
from iveg.domain.observations import Climate, Instant
from iveg.domain.stamps import format_stamp
from iveg.lab.emulator.orders import FaultOrder, read_order
from iveg.lab.emulator.ros2_base import Ros2Base
from iveg.lab.emulator.world import EmulatedSensors, RobotHardware, SimulatedWorld
from iveg.ngsi import names
from iveg.ngsi.codec import write_climate
from iveg.robot.node import (
    LONGEST_STEP_S,
    SLOTS,
    NodeSettings,
    RobotNode,
    every,
    in_slots,
)
from iveg.robot.ros2.config import RobotConfig, RosTable
from iveg.robot.ros2.outputs import Network
from iveg.ros2.names import namespace_of

_DAY_S = 86_400.0


def climate_at(wall: float) -> Climate:
    """Climate at a time of day (Unix s): warm and dry at 14 h UTC, humid at night.

    Typical of a Mediterranean greenhouse in spring; CO₂ falls while the crop works.
    """
    warmth = math.cos((wall % _DAY_S - 14 * 3600.0) / _DAY_S * math.tau)
    return Climate(
        temperature=round(22.0 + 6.0 * warmth, 2),
        relative_humidity=round(0.70 - 0.12 * warmth, 3),
        co2=round(430.0 - 60.0 * warmth, 1),
    )


class Wave(NamedTuple):
    """A measure that swings about its mean."""

    mean: float
    swing: float
    period_s: float


EQUIPMENT: Mapping[str, Mapping[str, Wave]] = {
    "fertigation-1": {
        "conductivity": Wave(2.4, 0.25, 2500.0),
        "acidity": Wave(5.8, 0.15, 1900.0),
        "flow": Wave(9.25, 9.25, 3600.0),
    },
    "osmosis-1": {
        "permeateConductivity": Wave(90.0, 20.0, 7200.0),
        "pressure": Wave(10.25, 1.25, 7200.0),
    },
}
"""Measures of other equipment, by device."""


def measures_of(device: str, wall: float) -> dict[str, float]:
    """Values of a device at a time (Unix s)."""
    return {
        name: round(mean + swing * math.sin(wall / period_s * math.tau), 3)
        for name, (mean, swing, period_s) in EQUIPMENT[device].items()
    }


def send_equipment(link: MqttLink, apikey: str, wall: float) -> None:
    """Have each device send what it measures now."""
    for device in EQUIPMENT:
        measures = measures_of(device, wall)
        payload = orjson.dumps({**measures, "TimeInstant": format_stamp(wall)})
        link.enqueue(names.measure_topic(apikey, device), payload)


_NAVIGATION_EVERY_S = 1.0


@dataclass(frozen=True, slots=True)
class FleetSettings:
    """Settings shared by all robots of a run.

    Attributes:
        held: The boot hold is not released at the robots.
        rate_hz: Of odometry, laser and camera each.
        has_equipment: Whether other equipment measures, too (``equipment``).
    """

    node: NodeSettings
    held: bool = False
    rate_hz: float = 30.0
    has_equipment: bool = False


class EmulatedLink(MqttLink):
    """Link to the broker that may swallow what a robot says, without an error.

    Args:
        is_mute: Whether it does so now.
    """

    def __init__(
        self, address: BrokerAddress, name: str, is_mute: Callable[[], bool]
    ) -> None:
        super().__init__(address, name)
        self._is_mute = is_mute

    def enqueue(self, topic: str, payload: bytes, qos: int = 0) -> None:
        """Send it, or swallow it."""
        if not self._is_mute():
            super().enqueue(topic, payload, qos)

    async def publish(
        self, topic: str, payload: bytes, qos: int = 1, *, retain: bool = False
    ) -> None:
        """Send it, or swallow it."""
        if not self._is_mute():
            await super().publish(topic, payload, qos, retain=retain)


class EmulatedRobot:
    """One rig and its safety node, called in their slots."""

    def __init__(
        self,
        rig: RobotHardware,
        world: SimulatedWorld,
        settings: FleetSettings,
    ) -> None:
        self.robot_id = rig.robot_id
        self._rig = rig
        self._world = world
        self._rate_hz = settings.rate_hz
        self._run_began = 0.0
        self._navigation_sent: tuple[str, float] = ("", -_NAVIGATION_EVERY_S)
        self._sensors = EmulatedSensors()
        self._requested = REST
        self._node = RobotNode(
            self.robot_id,
            replace(
                settings.node,
                read_clock=self._read_clock,
                open_link=partial(EmulatedLink, is_mute=self._is_mute),
            ),
            profile=self._rig.profile,
            drive=self._obey_gate,
            navigate=partial(self._rig.pursue, around=self._world),
        )
        if not settings.held:
            self._node.release_locally()

    async def run(self, began: float, phase: float) -> None:
        """Drive and sense until cancelled; ``began`` is when the run began."""
        self._run_began = began
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._node.run(), name=f"node-{self.robot_id}")
            await asyncio.sleep(phase)
            slots = self._drive, self._scan, self._look
            await in_slots(1.0 / self._rate_hz, slots)

    # --- the slots ----------------------------------------------------------------

    def _now(self) -> float:
        return clock.mono() - self._run_began

    def _drive(self, dt: float) -> None:
        now, node = self._now(), self._node
        # While twists have no effect navigation requests zero: the gate requires that
        # before it lets the robot move again.
        requested = self._rig.requested_twist(now, self._world)
        self._requested = requested if node.may_drive else REST
        node.request_twist(self._requested)
        self._rig.move(min(dt * SLOTS, LONGEST_STEP_S))
        node.sense(self._rig.odometry())
        navigation = self._rig.navigation()
        task, published_at = self._navigation_sent
        if navigation.task != task or now - published_at >= _NAVIGATION_EVERY_S:
            self._navigation_sent = (navigation.task, now)
            node.sense(navigation)
        for reading in self._sensors.due(now):
            node.sense(reading)

    def _scan(self, _: float) -> None:
        self._node.sense(self._rig.scan(self._world))

    def _look(self, _: float) -> None:
        self._node.sense(self._rig.detect(self._now(), self._world))

    def _obey_gate(self, command: Twist2D) -> None:
        """Apply the gate's command; with the fault ``deaf`` only a halt."""
        ignores = self._rig.faults.deaf and command != REST
        self._rig.drive(self._requested if ignores else command)

    def _read_clock(self) -> Instant:
        """The robot's own clocks; the wall clock may be wrong."""
        now = clock.now()
        return Instant(now.mono, now.wall + (self._rig.faults.clock_offset_s or 0.0))

    def _is_mute(self) -> bool:
        return bool(self._rig.faults.mute)

    # --- faults -------------------------------------------------------------------

    def obey(self, order: FaultOrder) -> None:
        """Execute a fault order in the order of its fields."""
        self._rig.obey(order)
        if order.local_hold is not None:
            self._node.add_local_hold(order.local_hold)
        if order.release_locally:
            self._node.release_locally()


_CLIMATE_EVERY_S = 10.0


class SimulatedFleet:
    """Robots and people of a run, advanced in real time.

    Args:
        world: Robots and people.
        settings: Those of all robots; the directory of the hold files is made if
            missing.
        network: DDS: the robots are ROS 2 bases there, controlled by ``iveg robot``;
            topics are below ``/`` and the robot's id in lower case.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        settings: FleetSettings,
        network: Network | None = None,
    ) -> None:
        self._world = world
        self._settings = settings
        settings.node.directory.mkdir(parents=True, exist_ok=True)
        self._robots: dict[str, EmulatedRobot | Ros2Base] = {}
        for robot_id, rig in world.rigs.items():
            if network is None:
                self._robots[robot_id] = EmulatedRobot(rig, world, settings)
            else:
                config = RobotConfig(
                    ros=RosTable(namespace=f"/{namespace_of(robot_id)}")
                )
                self._robots[robot_id] = Ros2Base(
                    rig, world, network, config, settings.rate_hz
                )

    async def run_with_faults(self, port: int) -> None:
        """Run until cancelled, and take fault orders on this port of loopback.

        ``POST /`` with a ``FaultOrder``; 204 when done, 400 when it cannot be read,
        with a sentence that names the field, 409 when there is no such robot.

        Raises:
            OSError: the port is in use.
        """
        async with post_listener(self._obey, "127.0.0.1", port):
            await self.run()

    async def run(self) -> None:
        """Run until cancelled."""
        began, period = clock.mono(), 1.0 / self._settings.rate_hz
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(every(period, self._walk), name="people")
            tasks.create_task(self._climate(), name="climate")
            for place, robot in enumerate(self._robots.values()):
                phase = place * period / SLOTS / len(self._robots)
                tasks.create_task(robot.run(began, phase), name=f"rig-{robot.robot_id}")

    def _walk(self, dt: float) -> None:
        self._world.walk(min(dt, LONGEST_STEP_S))

    async def _climate(self) -> None:
        link = MqttLink(self._settings.node.address, "climate")
        topic = names.measure_topic(self._settings.node.apikey, names.CLIMATE_DEVICE)

        def measure(_: float) -> None:
            wall = clock.wall()
            link.enqueue(topic, write_climate(climate_at(wall), format_stamp(wall)))
            if self._settings.has_equipment:
                send_equipment(link, self._settings.node.apikey, wall)

        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(link.run(), name="climate-link")
            await every(_CLIMATE_EVERY_S, measure)

    def _obey(self, body: bytes) -> tuple[HTTPStatus, str]:
        try:
            order = read_order(body)
        except UnreadableError as error:
            return HTTPStatus.BAD_REQUEST, str(error)
        robot = self._robots.get(order.robot)
        if robot is None:
            return HTTPStatus.CONFLICT, f"there is no robot {order.robot}"
        robot.obey(order)
        return HTTPStatus.NO_CONTENT, ""
