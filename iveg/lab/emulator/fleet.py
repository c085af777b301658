"""Scenario in real time: each robot's rig under its own safety node, over MQTT.

A robot's period has three slots: drive and odometry, laser, camera.  The slots of the
robots are staggered, so that neither this process nor the broker gets bursts.  A late
slot is skipped, never repeated.  Devices of climate and other equipment are apart from
robots and people: they send MQTT to the agent, as real ones would;
``iveg/data/equipment.toml`` shows them as tiles.
"""

import asyncio
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import orjson

from iveg.adapters import clock
from iveg.adapters.mqtt import MqttLink
from iveg.domain.geometry import REST
from iveg.domain.observations import Climate
from iveg.domain.stamps import format_stamp
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


EQUIPMENT: Mapping[str, Mapping[str, tuple[float, float, float]]] = {
    "fertigation-1": {
        "conductivity": (2.4, 0.25, 2500.0),
        "acidity": (5.8, 0.15, 1900.0),
        "flow": (9.25, 9.25, 3600.0),
    },
    "osmosis-1": {
        "permeateConductivity": (90.0, 20.0, 7200.0),
        "pressure": (10.25, 1.25, 7200.0),
    },
}
"""Measures of other equipment, by device: mean, swing about it, and its period (s)."""


def measures_of(device: str, wall: float) -> dict[str, float]:
    """Values of a device at a time (Unix s)."""
    return {
        name: round(mean + swing * math.sin(wall / period_s * math.tau), 3)
        for name, (mean, swing, period_s) in EQUIPMENT[device].items()
    }


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
        self._node = RobotNode(
            self.robot_id,
            settings.node,
            profile=self._rig.profile,
            drive=self._rig.drive,
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
            await in_slots(1.0 / self._rate_hz, (self._drive, self._scan, self._look))

    # --- the slots ----------------------------------------------------------------

    def _now(self) -> float:
        return clock.mono() - self._run_began

    def _drive(self, dt: float) -> None:
        now, node = self._now(), self._node
        # While twists have no effect navigation requests zero: the gate requires that
        # before it lets the robot move again.
        requested = self._rig.requested_twist(now, self._world)
        node.request_twist(requested if node.machine.may_drive else REST)
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


_CLIMATE_EVERY_S = 10.0


class SimulatedFleet:
    """Robots and people of a run, advanced in real time.

    Args:
        world: Robots and people.
        settings: Those of all robots.
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
        self._robots: list[EmulatedRobot | Ros2Base] = []
        for robot_id, rig in world.rigs.items():
            if network is None:
                self._robots.append(EmulatedRobot(rig, world, settings))
            else:
                config = RobotConfig(
                    ros=RosTable(namespace=f"/{namespace_of(robot_id)}")
                )
                self._robots.append(
                    Ros2Base(rig, world, network, config, settings.rate_hz)
                )

    async def run(self) -> None:
        """Run until cancelled."""
        began, period = clock.mono(), 1.0 / self._settings.rate_hz
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(every(period, self._walk), name="people")
            tasks.create_task(self._climate(), name="climate")
            for place, robot in enumerate(self._robots):
                phase = place * period / SLOTS / len(self._robots)
                tasks.create_task(robot.run(began, phase), name=f"rig-{robot.robot_id}")

    def _walk(self, dt: float) -> None:
        self._world.walk(min(dt, LONGEST_STEP_S))

    async def _climate(self) -> None:
        """Have the devices of climate and other equipment send what they measure."""
        node = self._settings.node
        link, topic = MqttLink(node.address, "climate"), names.measure_topic
        equipment = EQUIPMENT if self._settings.has_equipment else ()

        def measure(_: float) -> None:
            wall = clock.wall()
            stamp = format_stamp(wall)
            climate = write_climate(climate_at(wall), stamp)
            link.enqueue(topic(node.apikey, names.CLIMATE_DEVICE), climate)
            for device in equipment:
                measures = measures_of(device, wall) | {"TimeInstant": stamp}
                link.enqueue(topic(node.apikey, device), orjson.dumps(measures))

        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(link.run(), name="climate-link")
            await every(_CLIMATE_EVERY_S, measure)
