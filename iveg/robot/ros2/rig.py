"""A robot between its ROS 2 topics and iVeg: Algorithms 1 and 3 over DDS.

Thirty times a second the newest message of each topic goes through the safety node to
iVeg; a twist of navigation waits 10 ms for the gate at most.  Only the gate's output is
published on the drive's topic, repeatedly while it is zero; when this process ends, so
does publishing.
"""

import asyncio
import itertools
import logging

from iveg.adapters import clock
from iveg.domain.errors import HopError
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Twist2D
from iveg.domain.goals import Goal
from iveg.domain.laser import Outline
from iveg.domain.observations import RobotFault
from iveg.robot.costmap import FleetCostmap
from iveg.robot.node import NodeSettings, RobotNode, every
from iveg.robot.ros2 import outputs
from iveg.robot.ros2.checking import Lookout
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.inputs import SensorInputs, Subscriptions
from iveg.robot.ros2.outputs import (
    CostmapTopic,
    DriveTopics,
    Network,
    Writer,
    message_of,
    pose_for,
)
from iveg.robot.ros2.reading import speed_of
from iveg.robot.ros2.topics import TOPICS
from iveg.ros2 import cdr
from iveg.ros2 import messages as ros

_log = logging.getLogger(__name__)
RATE_HZ = 30.0
_WISH_HZ = 100.0
_LOOK_ROUND_TICKS, _TELL_TICKS = 15, 6
"""Ticks from a check of endpoints, or an output of neighbours, to the next."""


class Ros2Robot:
    """One robot.

    Args:
        robot_id: Its id in iVeg.
        config: Names of topics and frames.
        network: The network.
        inputs: Its sensors.
        settings: Those of its safety node; its costmap covers the plan's bounds.
        profile: Its body and drive.
    """

    def __init__(
        self,
        robot_id: str,
        config: RobotConfig,
        network: Network,
        inputs: SensorInputs,
        settings: NodeSettings,
        profile: RobotProfile,
    ) -> None:
        self._id = robot_id
        self._config, self._names = config, config.full_topics
        self._network = network
        self.inputs, self._faults = inputs, inputs.input_faults
        self._topics = DriveTopics(config, self._faults)
        outline, plan = Outline(profile.length, profile.width), settings.limits.plan
        bounds = None if plan is None else plan.bounds
        self._fleet_costmap = FleetCostmap(robot_id, outline, bounds)
        self._logged: frozenset[tuple[str, str]] = frozenset()
        self._lookout = Lookout(config, self._faults, clock.mono())
        self._ticks = itertools.count()
        self._open(network)
        self.node = RobotNode(
            robot_id,
            settings,
            profile=profile,
            drive=self._drive,
            navigate=self.navigate,
        )
        self._costmap = self._open_costmap(network)

    def _open(self, network: Network) -> None:
        quality, drive = self._config.quality, self._config.drive
        self._subscriptions = Subscriptions(self._config, network)
        # Depth 1: of several waiting twists only the newest may drive.
        self._wishes = network.reader(
            self._names["cmd_vel_in"],
            message_of(stamped=drive.stamped_in),
            quality("cmd_vel_in").newest(),
        )
        self._out = network.writer(
            self._names["cmd_vel_out"],
            message_of(stamped=drive.stamped_out),
            quality("cmd_vel_out").newest(),
        )
        self._goal, self._cloud, self._markers = (
            network.writer(name, TOPICS[topic].message, quality(topic).newest())
            if (name := self._names[topic])
            else None
            for topic in ("goal", "obstacles", "markers")
        )

    def _open_costmap(self, network: Network) -> CostmapTopic | None:
        name = self._names["costmap"]
        if not name:
            return None
        quality = self._config.quality("costmap")
        return CostmapTopic(
            network.writer(name, TOPICS["costmap"].message, quality),
            self._fleet_costmap,
            self.node,
            self._config.frames.map,
            self.inputs.pose,
        )

    async def run(self) -> None:
        """Run until cancelled; the drive is left at rest."""
        async with asyncio.TaskGroup() as tasks:
            for name, work in (
                ("node", self.node.run()),
                ("senses", every(1 / RATE_HZ, self._tick)),
                ("wishes", every(1 / _WISH_HZ, self._take_wish)),
            ):
                tasks.create_task(work, name=f"{self._id}-{name}")
            if self._costmap is not None:
                tasks.create_task(self._costmap.run(), name=f"{self._id}-costmap")

    def _tick(self, _: float) -> None:
        number = next(self._ticks)
        self._sense()
        if number % _LOOK_ROUND_TICKS == 0:
            self._look_round()
        if number % _TELL_TICKS == 0:
            self._tell_neighbours()

    # --- in -----------------------------------------------------------------------

    def _sense(self) -> None:
        now = clock.now()
        for topic, form, waited in self._subscriptions.take():
            self.inputs.receive(topic, waited, now.mono, form)
        for sensed in self.inputs.tick(now):
            self.node.sense(sensed.observation, age_s=sensed.age_s)
        self._judge(now.mono)

    def _judge(self, now: float) -> None:
        faults = self._faults.faults(now)
        self.node.limit(*speed_of(faults))
        self.node.faults = faults
        self._log(faults)

    def _log(self, faults: tuple[RobotFault, ...]) -> None:
        """Log each fault once at its start and once at its end."""
        present = frozenset((fault.code, fault.about) for fault in faults)
        for code, about in present - self._logged:
            _log.warning("%s: fault %s, %s", self._id, code, about)
        for code, about in self._logged - present:
            _log.warning("%s: fault %s is over, %s", self._id, code, about)
        self._logged = present

    def _take_wish(self, _: float) -> None:
        """Hand the newest twist of navigation to the gate."""
        waited = self._wishes.take()
        wish = self._topics.read(waited[-1], clock.mono()) if waited else None
        if wish is not None:
            self.node.request_twist(wish)

    def _look_round(self) -> None:
        """Check the endpoints of others, and subscribe to those that have joined."""
        endpoints = self._network.endpoints()
        self._lookout.look(endpoints, clock.mono())
        self._subscriptions.meet(endpoints)

    # --- out ----------------------------------------------------------------------

    def _drive(self, twist: Twist2D) -> None:
        try:
            self._out.write(self._topics.write(twist, clock.wall()))
        except HopError:
            # No command arrives, so the base halts by its own time-out.
            out = self._names["cmd_vel_out"]
            self._faults.note("drive_refused", out, clock.mono())

    def navigate(self, goal: Goal | None) -> bool:
        """Publish a goal; None sends the own pose, as no topic takes a goal back."""
        writer, own = _subscribed(self._goal), self.inputs.pose()
        if writer is None or own is None:
            return False
        frame = self._config.frames.map
        try:
            writer.write(cdr.write(pose_for(goal, own, clock.wall(), frame)))
        except HopError as error:
            _log.warning("%s: goal not published: %s", self._id, error)
            return False
        return True

    def _tell_neighbours(self) -> None:
        own, frames = self.inputs.pose(), self._config.frames
        cloud, drawing = _subscribed(self._cloud), _subscribed(self._markers)
        if own is None or (cloud is None and drawing is None):
            return
        now = clock.now()
        stamp, present = (
            ros.Time.from_seconds(now.wall),
            self.node.machine.authors.neighbours(now.mono),
        )
        if cloud is not None:
            points = outputs.cloud(present, own, stamp, frames.base_link)
            cloud.write(cdr.write(points))
        if drawing is not None:
            drawing.write(cdr.write(outputs.markers(present, stamp, frames.map)))


def _subscribed(writer: Writer | None) -> Writer | None:
    """The writer if it has subscribers."""
    return writer if writer is not None and writer.readers else None
