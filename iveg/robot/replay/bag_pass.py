"""One pass over a bag: its messages as observations in ``map``, as on a live robot.

What a bag leaves out is stood in for: without ``map`` the root of its odometry is
``map``; without odometry among its transforms the odometry itself leads to the robot;
without the frame of its laser the laser sits where the fleet file says.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    UNKNOWN_ORIGIN,
    DetectionFrame,
    Instant,
    LaserScan,
    Odometry,
)
from iveg.robot.grounding.locate import DEFAULT as GROUNDING
from iveg.robot.replay.bag_plan import Use
from iveg.robot.ros2.boxes import Boxes
from iveg.robot.ros2.camera import Camera
from iveg.robot.ros2.config import Frames
from iveg.robot.ros2.detectors import BOXES, LOOKS
from iveg.robot.ros2.input_faults import InputFaults
from iveg.robot.ros2.places import Places
from iveg.robot.ros2.reading import read_pose, read_scan, read_twist
from iveg.robot.ros2.rigid import IDENTITY, RigidTransform
from iveg.ros2 import detector_messages as d
from iveg.ros2 import geometry_msgs, nav_msgs, sensor_msgs, std_msgs
from iveg.ros2.schema import Message

_MAX_AGE_S = 1.0
"""Greatest age of a transform (s); maps are corrected less often in recordings."""
BagObservation = Odometry | LaserScan | DetectionFrame
_UNPLACED = "boxes without depth"


class BagPass:
    """State of one pass.

    Args:
        uses: Topics that are read, by name.
        tree: Links of the bag that are known before its first message.
        mount: The laser's pose in ``base_link``, unless the bag has it.

    Attributes:
        used: Messages that gave an observation, by topic.
        losses: Messages that gave none, by topic and reason; of detection frames those
            of which a box has no place.
    """

    def __init__(self, uses: Mapping[str, Use], tree: "BagTree", mount: Pose2D) -> None:
        self.used: Counter[str] = Counter()
        self.losses: Counter[tuple[str, str]] = Counter()
        self._mount = mount
        self._tree = tree
        self._notes = _Notes()
        self._places = Places(tree.frames, _MAX_AGE_S, self._notes)
        for links in tree.links:
            self._places.add(links, static=True)
        names = {use.role: name for name, use in uses.items()}
        seen = names.get("detections", "")
        self._boxes = Boxes(seen, (), self._places, self._notes)
        called = {"detections_2d": seen, "depth": names.get("depth", "")}
        self._camera = Camera(called, (), GROUNDING, self._places, self._notes)
        self._detector = seen
        self._works: dict[str, Callable[[Any, Instant], BagObservation | None]] = {
            "odometry": self._odometry,
            "scan": self._scan,
            "detections": self._detections,
            "depth": self._camera.add_depth,
            "camera_info": self._camera.set_info,
            "tf": lambda one, _: self._places.add(one, static=False),
            "tf_static": lambda one, _: self._places.add(one, static=True),
        }

    def observe(self, use: Use, message: object, now: float) -> BagObservation | None:
        """What follows from one message; ``now`` is when it was written (s).

        Raises:
            UnreadableError: values out of range.
        """
        self._notes.reasons.clear()
        found = self._works[use.role](message, Instant(now, now))
        if use.role in ("odometry", "scan"):
            self._count(use.topic.name, is_lost=found is None)
        elif isinstance(found, DetectionFrame):
            self._count(self._detector, is_lost=bool(found.unread))
        return found

    def late_frame(self, now: float) -> DetectionFrame | None:
        """The detection frame that has waited for its depth picture."""
        self._notes.reasons.clear()
        found = self._camera.locate(now)
        if found is not None:
            self._count(self._detector, is_lost=bool(found.unread))
        return found

    def _count(self, topic: str, *, is_lost: bool) -> None:
        if is_lost:
            why = next(iter(self._notes.reasons), _UNPLACED)
            self.losses[topic, why] += 1
        else:
            self.used[topic] += 1

    def _odometry(self, message: nav_msgs.Odometry, now: Instant) -> Odometry | None:
        if self._tree.lacks_base:
            pose = read_pose(message)
            self._places.add(_link(message, pose), static=False)
        place = self._places.locate(message, now.mono)
        if place is None:
            return None
        twist = read_twist(message.twist.twist)
        return Odometry("", UNKNOWN_ORIGIN, place.flat(), twist)

    def _scan(self, message: sensor_msgs.LaserScan, now: Instant) -> LaserScan | None:
        frame, stamp = message.header.frame_id, message.header.stamp.seconds
        if not self._tree.has_mount(frame):
            return replace(read_scan(message, IDENTITY), mount=self._mount)
        mount = self._places.on_robot(frame, stamp, now.mono)
        return None if mount is None else read_scan(message, mount)

    def _detections(self, message: Message, now: Instant) -> DetectionFrame | None:
        if type(message) in BOXES and (type(message) not in LOOKS or _is_3d(message)):
            return self._boxes.locate(message, now.mono)
        self._camera.replace_look(message, now)
        return None


class BagTree:
    """What the transforms of a bag hold, as far as its beginning tells.

    Args:
        static: All static messages.
        moving: The first of the others.
        odometry: The first odometry; None without.

    Attributes:
        frames: Names of the robot's frames in the bag.
        lacks_base: Odometry must stand in for its own transform.
        links: What is known before the first message.
    """

    def __init__(
        self,
        static: Sequence[geometry_msgs.TFMessage],
        moving: Sequence[geometry_msgs.TFMessage],
        odometry: nav_msgs.Odometry | None,
    ) -> None:
        self._parents = {
            _bare(one.child_frame_id): _bare(one.header.frame_id)
            for message in (*static, *moving)
            for one in message.transforms
        }
        usual = Frames()
        odom = base = ""
        if odometry is not None:
            odom = _bare(odometry.header.frame_id)
            base = _bare(odometry.child_frame_id)
        odom, base = odom or usual.odom, base or usual.base_link
        if usual.base_link in self._up(base) or base in self._up(usual.base_link):
            base = usual.base_link  # odometry of a footprint
        self.frames = Frames(usual.map, odom, base)
        self.lacks_base = not {odom, usual.map} & set(self._up(base))
        root = self._up(odom)[-1]
        self.links = [*static]
        if usual.map not in self._up(odom):
            header = std_msgs.Header(frame_id=usual.map)
            self.links.append(
                geometry_msgs.TFMessage((geometry_msgs.TransformStamped(header, root),))
            )

    def has_mount(self, frame: str) -> bool:
        """Whether the bag tells where a frame is on the robot."""
        return bool(self._parents) and self.frames.base_link in self._up(_bare(frame))

    def _up(self, frame: str) -> list[str]:
        """A frame and its ancestors."""
        found = [frame]
        while (outer := self._parents.get(found[-1])) and outer not in found:
            found.append(outer)
        return found


class _Notes(InputFaults):
    """Reasons of what was just lost, beside faults that last."""

    def __init__(self) -> None:
        super().__init__()
        self.reasons: dict[str, None] = {}

    def note(
        self, code: str, about: str, now: float, for_s: float | None = None
    ) -> None:
        """Keep the reason, too."""
        super().note(code, about, now, for_s)
        self.reasons[f"{code}, {about}"] = None


def _link(odometry: nav_msgs.Odometry, pose: RigidTransform) -> geometry_msgs.TFMessage:
    """Odometry as a transform."""
    transform = geometry_msgs.Transform(
        geometry_msgs.Vector3(*pose.move), geometry_msgs.Quaternion(*pose.q)
    )
    child = odometry.child_frame_id or Frames().base_link
    one = geometry_msgs.TransformStamped(odometry.header, child, transform)
    return geometry_msgs.TFMessage((one,))


def _is_3d(message: Message) -> bool:
    return isinstance(message, d.DetectionArray) and any(
        one.bbox3d.frame_id for one in message.detections
    )


def _bare(frame: str) -> str:
    return frame.lstrip("/")
