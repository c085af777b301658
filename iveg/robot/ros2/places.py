"""Where a robot and its sensors are in ``map``; a missing transform is a fault."""

from dataclasses import dataclass

from iveg.robot.ros2.config import Frames
from iveg.robot.ros2.input_faults import InputFaults
from iveg.robot.ros2.reading import read_pose
from iveg.robot.ros2.rigid import RigidTransform
from iveg.robot.ros2.transforms import NoTransformError, TransformBuffer
from iveg.ros2 import geometry_msgs, nav_msgs


@dataclass(frozen=True, slots=True, eq=False)
class Here:
    """Pose of the robot in ``map`` and in its odometry frame, at a stamp (s)."""

    in_map: RigidTransform
    in_odom: RigidTransform
    odom: str
    stamp: float


class Places:
    """Newest pose of a robot, and its transforms; ``now`` is monotonic seconds.

    Args:
        frames: Their names.
        max_age_s: Greatest age of a transform (s).
        input_faults: Record of faults.

    Attributes:
        here: None while the robot is not localised.
    """

    def __init__(
        self, frames: Frames, max_age_s: float, input_faults: InputFaults
    ) -> None:
        self._frames = frames
        self._max_age_s = max_age_s
        self._input_faults = input_faults
        self._transforms = TransformBuffer(max_age_s)
        self.here: Here | None = None

    def add(self, message: geometry_msgs.TFMessage, *, static: bool) -> None:
        """Store a message of ``/tf`` or ``/tf_static``."""
        self._transforms.add(message, static=static)

    def forget(self) -> None:
        """Delete what has a stamp, since the clock was set back."""
        self._transforms.clear()
        self.here = None

    def locate(self, odometry: nav_msgs.Odometry, now: float) -> RigidTransform | None:
        """Pose of the robot in ``map``; None where a transform is missing.

        Raises:
            UnreadableError: the pose is none.
        """
        stamp = odometry.header.stamp.seconds
        odom = odometry.header.frame_id.lstrip("/") or self._frames.odom
        in_odom = self._base_in_odom(odometry, stamp, now)
        to_map = self.in_map(odom, stamp, now)
        if in_odom is None or to_map is None:
            self.here = None
            return None
        place = to_map.compose(in_odom)
        self.here = Here(place, in_odom, odom, stamp)
        return place

    def _base_in_odom(
        self, odometry: nav_msgs.Odometry, stamp: float, now: float
    ) -> RigidTransform | None:
        pose = read_pose(odometry)
        child = odometry.child_frame_id.lstrip("/")
        if child in ("", self._frames.base_link):
            return pose
        base = self._lookup(child, self._frames.base_link, stamp, now)
        return None if base is None else pose.compose(base)

    def laser(self, frame: str, stamp: float, now: float) -> RigidTransform | None:
        """Pose of the laser relative to the robot's pose; None where one is missing."""
        here = self.here
        laser = self._laser(frame, stamp, now)
        late = here is None or abs(stamp - here.stamp) > self._max_age_s
        return None if late else laser

    def on_robot(self, frame: str, stamp: float, now: float) -> RigidTransform | None:
        """Pose of a frame in ``base_link``; None where one is missing."""
        return self._lookup(self._frames.base_link, frame, stamp, now)

    def _laser(self, frame: str, stamp: float, now: float) -> RigidTransform | None:
        here = self.here
        if here is not None:
            try:
                in_odom = self._transforms.lookup(here.odom, frame.lstrip("/"), stamp)
                return here.in_odom.inverse().compose(in_odom)
            except NoTransformError:
                pass  # odometry may be missing in the tree; the mount must be there
        return self.on_robot(frame, stamp, now)

    def in_map(self, frame: str, stamp: float, now: float) -> RigidTransform | None:
        """Pose of a frame in ``map``; None for a missing one."""
        return self._lookup(self._frames.map, frame, stamp, now)

    def knows(self, frame: str, *, on_robot: bool = False) -> bool:
        """Whether the tree leads from a frame to ``map``, however old its links are.

        Args:
            frame: As in a header.
            on_robot: The way to ``base_link`` is enough, as for a laser.
        """
        up = self._transforms.chain(frame.lstrip("/"))
        return self._frames.map in up or (on_robot and self._frames.base_link in up)

    def _lookup(
        self, outer: str, inner: str, stamp: float, now: float
    ) -> RigidTransform | None:
        try:
            return self._transforms.lookup(outer, inner.lstrip("/"), stamp)
        except NoTransformError as error:
            self._input_faults.note("no_transform", error.link, now, error.for_s)
            return None
