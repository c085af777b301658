"""Emulated ROS 2 base: navigates, publishes its topics and executes ``cmd_vel``."""

import asyncio
import logging
import math
from typing import Any

from iveg.adapters import clock
from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.goals import Goal
from iveg.domain.observations import Detection
from iveg.lab.emulator.world import EmulatedSensors, RobotHardware, SimulatedWorld
from iveg.robot.node import LONGEST_STEP_S, SLOTS, every, in_slots
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.outputs import Network, Reader
from iveg.robot.ros2.reading import read_twist, write_twist
from iveg.robot.ros2.topics import ROS_SENSORS, TOPICS
from iveg.ros2 import cdr
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message

TIMEOUT_S = 0.5
"""A base without a command for this long halts (s)."""


_TRIES_S, _RESTS_S = 1.0, 0.8


def wished_twist(requested: Twist2D, driven: Twist2D, now: float) -> Twist2D:
    """Twist of a navigation, which gives up now and then while the base rests.

    After a resume the gate stays closed until zero was requested; a real navigation
    without progress cancels its goal and requests zero.

    Args:
        requested: The twist that leads on.
        driven: Last command of the base.
        now: Monotonic (s).
    """
    gives_up = driven == REST and now % (_TRIES_S + _RESTS_S) > _TRIES_S
    return REST if gives_up else requested


class DriveWatchdog:
    """The drive's own watchdog: the newest command while it is valid."""

    def __init__(self) -> None:
        self._command, self._at = REST, -math.inf

    def replace_command(self, command: Twist2D, now: float) -> None:
        """Note the newest command."""
        self._command, self._at = command, now

    def command(self, now: float) -> Twist2D:
        """Command for the wheels; zero when none came for half a second."""
        return self._command if now - self._at <= TIMEOUT_S else REST


_log = logging.getLogger(__name__)
_LASER = "laser"
_PUBLISHED = (
    *("odometry", "scan", "detections_3d", "path"),
    *("tf", "tf_static", "cmd_vel_in"),
)


class Ros2Base:
    """One rig on ROS 2 topics.

    Args:
        rig: The machine.
        world: World it drives in.
        network: DDS.
        config: Names of its topics and frames.
        rate_hz: Of odometry, laser and camera each.
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
        self._rig, self._world = rig, world
        self._frames = config.frames
        self._rate_hz = rate_hz
        self._base = DriveWatchdog()
        self._odom_in_map = rig.vehicle.pose
        self._run_began = 0.0
        names = config.full_topics
        self._writers = {
            topic: network.writer(
                names[topic], TOPICS[topic].message, config.quality(topic)
            )
            for topic in (*_PUBLISHED, *ROS_SENSORS)
        }
        self._commands, self._goals = (
            network.reader(
                names[topic], TOPICS[topic].message, config.quality(topic).newest()
            )
            for topic in ("cmd_vel_out", "goal")
        )
        self._sensors = EmulatedSensors()

    def _publish(self, topic: str, message: Message) -> None:
        self._writers[topic].write(cdr.write(message))

    async def run(self, began: float, phase: float) -> None:
        """Drive and sense until cancelled; ``began`` is when the run began."""
        self._run_began = began
        self._publish("tf_static", self._mounts())
        await asyncio.sleep(phase)
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(every(1.0, self._tell_slowly), name="slow")
            await in_slots(1.0 / self._rate_hz, (self._drive, self._scan, self._look))

    # --- the slots ----------------------------------------------------------------

    def _drive(self, dt: float) -> None:
        now = clock.now()
        self._read_command(now.mono)
        self._read_goal()
        command = self._base.command(now.mono)
        self._rig.drive(command)
        requested = self._rig.requested_twist(now.mono - self._run_began, self._world)
        wished = wished_twist(requested, command, now.mono)
        self._publish("cmd_vel_in", write_twist(wished))
        self._rig.move(min(dt * SLOTS, LONGEST_STEP_S))
        self._tell_place(ros.Time.from_seconds(now.wall))

    def _read_command(self, now: float) -> None:
        twist = self._newest(self._commands, ros.Twist)
        if twist is not None:
            self._base.replace_command(read_twist(twist), now)

    def _read_goal(self) -> None:
        """Take the newest goal; one without a way is left, as Nav2 aborts it."""
        goal = self._newest(self._goals, ros.PoseStamped)
        if goal is not None:
            place = goal.pose.position
            self._rig.pursue(Goal("", "here", place.x, place.y), self._world)

    def _newest(self, reader: Reader, form: type[Message]) -> Any:
        """The newest message of a topic; None for none, or one that is unusable."""
        waited = reader.take()
        try:
            return cdr.read(form, waited[-1]) if waited else None
        except UnreadableError as error:
            _log.warning("%s: unusable message: %s", self.robot_id, error)
            return None

    def _tell_place(self, stamp: ros.Time) -> None:
        measured = self._rig.odometry()
        in_odom = _relative(self._odom_in_map, measured.pose)
        frames = self._frames
        odometry = ros.Odometry(
            ros.Header(stamp, frames.odom),
            frames.base_link,
            ros.PoseWithCovariance(_pose(in_odom)),
            ros.TwistWithCovariance(write_twist(measured.twist)),
        )
        links = (
            _link(stamp, frames.map, frames.odom, self._odom_in_map),
            _link(stamp, frames.odom, frames.base_link, in_odom),
        )
        self._publish("tf", ros.TFMessage(links))
        self._publish("odometry", odometry)

    def _scan(self, _: float) -> None:
        sweep = self._rig.scan(self._world)
        message = ros.LaserScan(
            ros.Header(ros.Time.from_seconds(clock.wall()), _LASER),
            sweep.angle_min,
            sweep.angle_min + sweep.angle_increment * (sweep.ranges.size - 1),
            sweep.angle_increment,
            0.0,
            1.0 / self._rate_hz,
            sweep.range_min,
            sweep.range_max,
            sweep.ranges,
        )
        self._publish("scan", message)

    def _look(self, _: float) -> None:
        now = clock.now()
        frame = self._rig.detect(now.mono - self._run_began, self._world)
        header = ros.Header(ros.Time.from_seconds(now.wall), self._frames.base_link)
        boxes = tuple(_detection(box, header) for box in frame.detections)
        self._publish("detections_3d", ros.Detection3DArray(header, boxes))

    def _tell_slowly(self, _: float) -> None:
        header = ros.Header(ros.Time.from_seconds(clock.wall()), self._frames.map)
        path = self._rig.navigation().path
        poses = tuple(
            ros.PoseStamped(header, _pose(Pose2D(x, y, 0.0))) for x, y in path
        )
        self._publish("path", ros.Path(header, poses))
        for reading in self._sensors.due(clock.mono() - self._run_began):
            for name, sensor in ROS_SENSORS.items():
                if isinstance(reading, sensor.observation):
                    self._publish(name, sensor.write(header, reading))

    def _mounts(self) -> ros.TFMessage:
        stamp = ros.Time.from_seconds(clock.wall())
        laser = self._rig.profile.laser
        return ros.TFMessage((_link(stamp, self._frames.base_link, _LASER, laser),))


def _relative(outer: Pose2D, pose: Pose2D) -> Pose2D:
    """A pose of ``map`` in a frame whose pose in ``map`` is ``outer``."""
    return Pose2D(*outer.inverse(pose.x, pose.y), pose.yaw - outer.yaw)


def _turned(yaw: float) -> ros.Quaternion:
    return ros.Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def _pose(pose: Pose2D) -> ros.Pose:
    return ros.Pose(ros.Point(pose.x, pose.y), _turned(pose.yaw))


def _link(
    stamp: ros.Time, outer: str, inner: str, pose: Pose2D
) -> ros.TransformStamped:
    transform = ros.Transform(ros.Vector3(pose.x, pose.y), _turned(pose.yaw))
    return ros.TransformStamped(ros.Header(stamp, outer), inner, transform)


def _detection(detection: Detection, header: ros.Header) -> ros.Detection3D:
    box, (x, y, z) = detection.box, detection.box.centre
    size = ros.Vector3(box.xmax - box.xmin, box.ymax - box.ymin, box.zmax - box.zmin)
    sure = ros.ObjectHypothesis(detection.class_id, detection.probability)
    centre = ros.Pose(ros.Point(x, y, z))
    return ros.Detection3D(
        header,
        (ros.ObjectHypothesisWithPose(sure, ros.PoseWithCovariance(centre)),),
        ros.BoundingBox3D(centre, size),
        detection.det_id or "",
    )
