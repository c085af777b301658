"""Runs a scenario in real time: each robot's rig under its own safety node, over MQTT.

The slots of the robots are staggered, so that neither this process nor the broker gets
bursts.  A late slot is skipped, never repeated.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from iveg.adapters import clock
from iveg.adapters.mqtt import MqttLink
from iveg.domain.errors import DataFileError
from iveg.domain.fleet import FleetDescription
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.stamps import format_stamp
from iveg.lab.emulator.climate import climate_at
from iveg.lab.emulator.detector_model import DETECTORS
from iveg.lab.emulator.emulated_robot import EmulatedRobot, FleetSettings
from iveg.lab.emulator.equipment import tell_all
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.orders import FaultOrder, Order, open_fault_port
from iveg.lab.emulator.radio import Radio
from iveg.lab.emulator.relay import Relay
from iveg.lab.emulator.ros2_base import Ros2Base
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.scripts import EXACT, Incident, SiteErrors
from iveg.lab.emulator.world import Camera, RobotHardware, SimulatedWorld
from iveg.ngsi import names
from iveg.ngsi.codec import write_climate
from iveg.robot.pacing import LONGEST_STEP_S, SLOTS, every
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.network import Network
from iveg.ros2.names import namespace_of

_log = logging.getLogger(__name__)
_CLIMATE_EVERY_S = 10.0


def _log_port(port: int) -> None:
    _log.info("faults are taken on 127.0.0.1:%d", port)


async def run_emulator(
    robots: Sequence[str],
    greenhouse: Greenhouse,
    settings: FleetSettings,
    *,
    scenario: str = "demo",
    seed: int = 1,
    profile: str = "simulation",
    faults: Sequence[FaultOrder] = (),
    fault_port: int | None = None,
    on_fault_port: Callable[[int], None] = _log_port,
    network: Network | None = None,
    description: FleetDescription | None = None,
    camera: Camera = "boxes",
    errors: SiteErrors = EXACT,
) -> None:
    """Run a scenario until cancelled.

    Args:
        robots: Their ids.
        greenhouse: Greenhouse they drive in.
        settings: Those of all robots; the directory of the hold files is made if
            missing.
        scenario: Name of a scenario of ``iveg.lab.emulator.scenarios``.
        seed: The same seed gives the same people and the same noise.
        profile: Of the detector: ``field``, ``simulation`` or ``perfect``.
        faults: Faults from the start.
        fault_port: Loopback port for fault orders; 0 takes a free one; None has none.
        on_fault_port: Called with the port in use.
        network: DDS: the robots are ROS 2 bases there, controlled by ``iveg robot``;
            topics are below ``/`` and the robot's id in lower case.
        description: Fleet description; None: the built-in one.
        camera: Source of the boxes: drawn about the truth, or by grounding.
        errors: Of the plan and of poses.

    Raises:
        DataFileError: no such scenario or profile, or too many robots for the
            greenhouse.
        SettingsError: the fault port is in use.
    """
    if profile not in DETECTORS:
        known = ", ".join(DETECTORS)
        raise DataFileError(f"profile {profile!r}", "", f"is not one of {known}.")
    played = replace(scenario_named(scenario), errors=errors)
    layout = lay_out(played, robots, greenhouse, description)
    detector = DETECTORS[layout.detector or profile]
    world = SimulatedWorld(greenhouse, layout, detector, seed, camera)
    incidents = (*(Incident(0.0, order) for order in faults), *layout.incidents)
    is_radio_bad = bool(incidents) or fault_port is not None
    bases = None
    if network is not None:
        bases = partial(_base, world, network, settings.rate_hz)
    radio_seed = seed if is_radio_bad and network is None else None
    fleet = SimulatedFleet(world, settings, radio_seed=radio_seed, bases=bases)
    if fault_port is None:
        await fleet.run(incidents)
        return
    async with open_fault_port(fault_port, fleet.obey) as port:
        on_fault_port(port)
        await fleet.run(incidents)


def _base(
    world: SimulatedWorld, network: Network, rate_hz: float, rig: RobotHardware
) -> Ros2Base:
    config = RobotConfig(namespace=f"/{namespace_of(rig.robot_id)}")
    return Ros2Base(rig, world, network, config, rate_hz)


class SimulatedFleet:
    """Robots and people of a run, advanced in real time.

    Args:
        radio_seed: Seed of the robots' radios, which then accept fault orders; None
            connects the robots directly to the broker.
        bases: Makes ROS 2 robots without iVeg's software.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        settings: FleetSettings,
        radio_seed: int | None = None,
        bases: Callable[[RobotHardware], Ros2Base] | None = None,
    ) -> None:
        self._world = world
        self._settings = settings
        self._started = clock.now()
        settings.node.directory.mkdir(parents=True, exist_ok=True)
        self._robots: Mapping[str, EmulatedRobot | Ros2Base] = {
            robot_id: EmulatedRobot(
                rig, world, settings, _relay(settings, robot_id, place, radio_seed)
            )
            if bases is None
            else bases(rig)
            for place, (robot_id, rig) in enumerate(world.rigs.items())
        }

    async def run(self, incidents: Sequence[Incident] = ()) -> None:
        """Run until cancelled."""
        self._started = clock.now()
        period = 1.0 / self._settings.rate_hz
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(every(period, self._walk), name="people")
            tasks.create_task(self._climate(), name="climate")
            for place, robot in enumerate(self._robots.values()):
                phase = place * period / SLOTS / len(self._robots)
                tasks.create_task(
                    robot.run(self._started.mono, phase), name=f"rig-{robot.robot_id}"
                )
            for incident in incidents:
                tasks.create_task(self._happen(incident), name="incident")

    def _walk(self, dt: float) -> None:
        self._world.walk(min(dt, LONGEST_STEP_S))

    async def _climate(self) -> None:
        link = MqttLink(self._settings.node.address, "climate")
        topic = names.measure_topic(self._settings.node.apikey, names.CLIMATE_DEVICE)

        def tell(_: float) -> None:
            wall = clock.wall()
            link.enqueue(topic, write_climate(climate_at(wall), format_stamp(wall)))
            if self._settings.has_equipment:
                tell_all(link, self._settings.node.apikey, wall)

        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(link.run(), name="climate-link")
            await every(_CLIMATE_EVERY_S, tell)

    async def _happen(self, incident: Incident) -> None:
        robot = self._robots.get(incident.order.robot)
        if robot is None:
            return
        await robot.started.wait()
        await asyncio.sleep(incident.at_s)
        while True:
            _log.info("%s", incident.order.model_dump_json(exclude_unset=True))
            robot.obey(incident.order)
            if incident.every_s == 0.0:
                return
            await asyncio.sleep(incident.every_s)

    def obey(self, order: Order) -> str | None:
        """Execute a fault order.

        Returns:
            None, or the reason why it cannot be done.
        """
        if isinstance(order, FaultOrder):
            robot = self._robots.get(order.robot)
            if robot is None:
                return f"there is no robot {order.robot}"
            if not robot.started.is_set():
                return f"{order.robot} has not started yet"
            robot.obey(order)
            return None
        if order.person >= len(self._world.people):
            return f"there are {len(self._world.people)} people, counted from 0"
        self._world.people[order.person].place(order.x, order.y, hold=order.hold)
        return None


def _relay(
    settings: FleetSettings, robot_id: str, place: int, seed: int | None
) -> Relay | None:
    """A robot's faulty link to the broker, with random numbers of its own."""
    if seed is None:
        return None
    devices = (f"{robot_id}_odom", robot_id)
    topics = {names.measure_topic(settings.node.apikey, one) for one in devices}
    topics.add(names.direct_topic(robot_id, "_odom"))
    radio = Radio(frozenset(topics), np.random.default_rng((seed, place)))
    return Relay(settings.node.address, radio)
