"""An emulated ROS 2 base: publishes its topics and executes ``cmd_vel``.

It stands for the base and Nav2 of a real robot, without safety node and MQTT; ``iveg
robot`` connects it to iVeg. A base without a command for half a second halts by itself,
whatever the last command was.
"""

import asyncio
import logging
import math

from iveg.adapters import clock
from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.goals import Goal
from iveg.domain.observations import Detection
from iveg.lab.emulator.greenhouse import into
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.ros2_navigation import DriveWatchdog, SimulatedNavigation
from iveg.lab.emulator.sensors import EmulatedSensors
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld
from iveg.robot.pacing import LONGEST_STEP_S, SLOTS, every, in_slots
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.network import Network, Writer
from iveg.robot.ros2.reading import read_twist, write_twist
from iveg.robot.ros2.sensors import ROS_SENSORS
from iveg.ros2 import cdr, geometry_msgs, nav_msgs, sensor_msgs, std_msgs, vision_msgs
from iveg.ros2.schema import Message

_log = logging.getLogger(__name__)
_SECOND = 1.0
_LASER = "laser"


class Ros2Base:
    """One rig on ROS 2 topics.

    Args:
        rig: The machine.
        world: World it drives in.
        network: DDS.
        config: Names of its topics and frames.
        rate_hz: Of odometry, laser and camera each.

    Attributes:
        started: Set when fault orders are accepted.
    """

    def __init__(
        self,
        rig: RobotHardware,
        world: SimulatedWorld,
        network: Network,
        config: RobotConfig,
        rate_hz: float,
    ) -> None:
        self.robot_id = rig.robot_id
        self.started = asyncio.Event()
        self._rig, self._world = rig, world
        self._frames = config.frames
        self._rate_hz = rate_hz
        self._base, self._navigation = DriveWatchdog(), SimulatedNavigation()
        self._odom_in_map = rig.vehicle.pose
        self._run_began = 0.0
        self._is_odometry_frozen = False
        names = config.full_topics

        def writer(topic: str, message: type[Message]) -> Writer:
            return network.writer(names[topic], message, config.qualities[topic])

        self._commands = network.reader(
            names["cmd_vel_out"],
            geometry_msgs.Twist,
            config.qualities["cmd_vel_out"].newest(50),
        )
        self._goals = network.reader(
            names["goal"], geometry_msgs.PoseStamped, config.qualities["goal"].newest()
        )
        self._wishes = writer("cmd_vel_in", geometry_msgs.Twist)
        self._tf, self._tf_static = (
            writer("tf", geometry_msgs.TFMessage),
            writer("tf_static", geometry_msgs.TFMessage),
        )
        self._odometry = writer("odometry", nav_msgs.Odometry)
        self._scans = writer("scan", sensor_msgs.LaserScan)
        self._seen = writer("detections_3d", vision_msgs.Detection3DArray)
        self._paths = writer("path", nav_msgs.Path)
        self._sensors = EmulatedSensors()
        self._readings = {
            sensor.of: (sensor, writer(name, sensor.message))
            for name, sensor in ROS_SENSORS.items()
        }

    async def run(self, began: float, phase: float) -> None:
        """Drive and sense until cancelled; ``began`` is when the run began."""
        self._run_began = began
        self._tf_static.write(cdr.write(self._mounts()))
        self.started.set()
        await asyncio.sleep(phase)
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(every(_SECOND, self._tell_slowly), name="slow")
            slots = self._drive, self._scan, self._look
            await in_slots(1.0 / self._rate_hz, slots)

    def obey(self, order: FaultOrder) -> None:
        """Execute the sensor faults of an order; the others concern its software."""
        if order.freeze_odometry is not None:
            self._is_odometry_frozen = bool(order.freeze_odometry)
        self._rig.obey(order)

    # --- the slots ----------------------------------------------------------------

    def _drive(self, dt: float) -> None:
        now = clock.now()
        self._read_commands(now.mono)
        self._read_goal()
        command = self._base.command(now.mono)
        self._rig.drive(command)
        requested = self._rig.requested_twist(now.mono - self._run_began, self._world)
        asked = self._navigation.requested_twist(requested, command, now.mono)
        self._wishes.write(cdr.write(write_twist(asked)))
        self._rig.move(min(dt * SLOTS, LONGEST_STEP_S))
        if not self._is_odometry_frozen:
            self._tell_place(std_msgs.Time.of(now.wall))

    def _read_commands(self, now: float) -> None:
        waited = self._commands.take()
        if not waited:
            return
        try:
            twist = read_twist(cdr.read(geometry_msgs.Twist, waited[-1]))
        except UnreadableError as error:
            _log.warning("%s: unusable command: %s", self.robot_id, error)
            return
        self._base.replace_command(twist, now)

    def _read_goal(self) -> None:
        """Take the newest goal; one without a way is left, as Nav2 aborts it."""
        waited = self._goals.take()
        if not waited:
            return
        try:
            place = cdr.read(geometry_msgs.PoseStamped, waited[-1]).pose.position
        except UnreadableError as error:
            _log.warning("%s: unusable goal: %s", self.robot_id, error)
            return
        self._rig.pursue(Goal("", "here", place.x, place.y), self._world)

    def _tell_place(self, stamp: std_msgs.Time) -> None:
        measured = self._rig.odometry()
        in_odom = _relative(self._odom_in_map, measured.pose)
        frames = self._frames
        odometry = nav_msgs.Odometry(
            std_msgs.Header(stamp, frames.odom),
            frames.base_link,
            geometry_msgs.PoseWithCovariance(_pose(in_odom)),
            geometry_msgs.TwistWithCovariance(write_twist(measured.twist)),
        )
        links = (
            _link(stamp, frames.map, frames.odom, self._odom_in_map),
            _link(stamp, frames.odom, frames.base_link, in_odom),
        )
        self._tf.write(cdr.write(geometry_msgs.TFMessage(links)))
        self._odometry.write(cdr.write(odometry))

    def _scan(self, _: float) -> None:
        sweep = self._rig.scan(self._world)
        message = sensor_msgs.LaserScan(
            std_msgs.Header(std_msgs.Time.of(clock.wall()), _LASER),
            sweep.angle_min,
            sweep.angle_min + sweep.angle_increment * (sweep.ranges.size - 1),
            sweep.angle_increment,
            0.0,
            1.0 / self._rate_hz,
            sweep.range_min,
            sweep.range_max,
            sweep.ranges,
        )
        self._scans.write(cdr.write(message))

    def _look(self, _: float) -> None:
        now = clock.now()
        frame = self._rig.detect(now.mono - self._run_began, self._world)
        header = std_msgs.Header(std_msgs.Time.of(now.wall), self._frames.base_link)
        seen = tuple(_detection(one, header) for one in frame.detections)
        self._seen.write(cdr.write(vision_msgs.Detection3DArray(header, seen)))

    def _tell_slowly(self, _: float) -> None:
        header = std_msgs.Header(std_msgs.Time.of(clock.wall()), self._frames.map)
        path = self._rig.navigation().path
        poses = tuple(
            geometry_msgs.PoseStamped(header, _pose(Pose2D(x, y, 0.0))) for x, y in path
        )
        self._paths.write(cdr.write(nav_msgs.Path(header, poses)))
        for reading in self._sensors.due(clock.mono() - self._run_began):
            if type(reading) in self._readings:
                sensor, out = self._readings[type(reading)]
                out.write(cdr.write(sensor.write(header, reading)))

    def _mounts(self) -> geometry_msgs.TFMessage:
        stamp = std_msgs.Time.of(clock.wall())
        laser = self._rig.profile.laser
        return geometry_msgs.TFMessage(
            (_link(stamp, self._frames.base_link, _LASER, laser),)
        )


def _relative(outer: Pose2D, pose: Pose2D) -> Pose2D:
    """A pose of ``map`` in a frame whose pose in ``map`` is ``outer``."""
    return Pose2D(*into(outer, pose.x, pose.y), pose.yaw - outer.yaw)


def _turned(yaw: float) -> geometry_msgs.Quaternion:
    return geometry_msgs.Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def _pose(pose: Pose2D) -> geometry_msgs.Pose:
    return geometry_msgs.Pose(geometry_msgs.Point(pose.x, pose.y), _turned(pose.yaw))


def _link(
    stamp: std_msgs.Time, outer: str, inner: str, pose: Pose2D
) -> geometry_msgs.TransformStamped:
    transform = geometry_msgs.Transform(
        geometry_msgs.Vector3(pose.x, pose.y), _turned(pose.yaw)
    )
    return geometry_msgs.TransformStamped(
        std_msgs.Header(stamp, outer), inner, transform
    )


def _detection(one: Detection, header: std_msgs.Header) -> vision_msgs.Detection3D:
    box, (x, y, z) = one.box, one.box.centre
    size = geometry_msgs.Vector3(
        box.xmax - box.xmin, box.ymax - box.ymin, box.zmax - box.zmin
    )
    sure = vision_msgs.ObjectHypothesis(one.class_id, one.probability)
    centre = geometry_msgs.Pose(geometry_msgs.Point(x, y, z))
    return vision_msgs.Detection3D(
        header,
        (
            vision_msgs.ObjectHypothesisWithPose(
                sure, geometry_msgs.PoseWithCovariance(centre)
            ),
        ),
        vision_msgs.BoundingBox3D(centre, size),
        one.det_id or "",
    )
