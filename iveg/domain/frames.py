"""Frames of reference of detected boxes (REP-103, REP-105), by the names of TF.

A box in ``map`` or ``base_link`` stays as it is; one of the camera is taken to
``base_link`` by the mount in the robot's description.  A box without a frame is in the
frame that the description names; where it names none, the box counts in ``base_link``
and in ``camera_link``.  A box in a frame that nobody described has no place.
"""

from functools import lru_cache
from typing import Literal, NamedTuple

from iveg.domain.fleet import Frame, RobotDescription, RobotProfile
from iveg.domain.geometry import Box3D, Pose2D
from iveg.domain.observations import Detection

_NAMED: dict[str, Frame] = {
    "map": "map",
    "base_link": "base_link",
    "camera_link": "camera_link",
    **{
        f"camera{kind}_optical{end}": "camera_optical_frame"
        for kind in ("", "_link", "_color", "_rgb", "_depth")
        for end in ("", "_frame")
    },
}
_NOT_ON_ROBOTS = frozenset({"map", "odom", "world", "earth"})
_EITHER: tuple[Frame, ...] = ("base_link", "camera_link")


class FramedBox(NamedTuple):
    """A box in ``map``, or in the ``base_link`` of the robot that saw it."""

    box: Box3D
    frame_id: Literal["map", "base_link"]

    def position(self, pose: Pose2D | None) -> tuple[float, float, float] | None:
        """Centre in ``map`` (m), seen by a robot at ``pose``; None: unknown."""
        x, y, z = self.box.centre
        if self.frame_id == "map":
            return x, y, z
        return None if pose is None else (*pose.transform(x, y), z)


def resolve_box(
    detection: Detection, robot: RobotDescription
) -> tuple[FramedBox | None, ...]:
    """Boxes of a detection, once for each frame that it may be in.

    Returns:
        None in place of a box whose frame nobody described.
    """
    return tuple(
        _in_known_frame(detection.box, frame, robot.profile)
        for frame in _frames_of(detection.frame_id, robot)
    )


def _frames_of(
    frame_id: str | None, robot: RobotDescription
) -> tuple[Frame | None, ...]:
    if frame_id is not None:
        if is_pose_frame(frame_id, robot):
            return ("map",)
        return (frame_named(frame_id, robot.robot_id, robot.profile.camera_frame),)
    described = robot.profile.unlabelled_frame
    return _EITHER if described is None else (described,)


@lru_cache(maxsize=256)
def frame_named(name: str, robot_id: str, camera: str | None = None) -> Frame | None:
    """Frame that a robot means by a name of TF; None for an unknown name.

    Args:
        name: The whole name; leading slashes and the robot's own prefix do not count
            (``/map``, ``AGI/base_link``, ``agi_camera_link``).  A name with the prefix
            of another robot is unknown.
        robot_id: The robot.
        camera: Name of its camera's frame, where the description has another.
    """
    whole = _whole_names(name, robot_id)
    if camera is not None and camera in whole:
        is_optical = camera.endswith(("_optical", "_optical_frame"))
        return "camera_optical_frame" if is_optical else "camera_link"
    return next((_NAMED[name] for name in whole if name in _NAMED), None)


def is_pose_frame(name: str, robot: RobotDescription) -> bool:
    """Whether odometry in a frame of this name tells where a robot is in ``map``."""
    return robot.pose_frame in _whole_names(name, robot.robot_id)


def may_be_laser_frame(name: str, robot_id: str) -> bool:
    """Whether a scan may be in a frame of this name: a level one on the robot."""
    # A scan is level; the plane of an optical frame stands upright.
    whole = _whole_names(name, robot_id)
    is_elsewhere = not _NOT_ON_ROBOTS.isdisjoint(whole)
    return bool(whole) and not is_elsewhere and "optical" not in name


def _whole_names(name: str, robot_id: str) -> tuple[str, ...]:
    """A frame's name without slashes and the robot's prefix; empty: another robot's.

    A frame's name may begin with a robot's name by chance, so both readings count.
    """
    *prefix, last = name.strip("/").split("/")
    # Names in ROS have an underscore where an id has a hyphen.
    own = robot_id.lower().replace("-", "_")
    if prefix and prefix[-1].lower() not in (own, robot_id.lower()):
        return ()
    if last.lower().startswith(f"{own}_"):
        return last, last[len(own) + 1 :]
    return (last,)


def _in_known_frame(
    box: Box3D, frame: Frame | None, profile: RobotProfile
) -> FramedBox | None:
    if frame == "map" or frame == "base_link":
        return FramedBox(box, frame)
    if frame is None or not profile.has_known_camera:
        return None
    upright = _upright(box) if frame == "camera_optical_frame" else box
    return FramedBox(_in_base_link(upright, profile), "base_link")


def _upright(box: Box3D) -> Box3D:
    """From optical axes (x right, y down, z forward) to x forward, y left, z up."""
    return Box3D(box.zmin, box.zmax, -box.xmax, -box.xmin, -box.ymax, -box.ymin)


def _in_base_link(box: Box3D, profile: RobotProfile) -> Box3D:
    """From ``camera_link`` to ``base_link``: the hull of the turned box.

    Turning keeps the centre: the centre of the hull is the turned centre.
    """
    corners = [
        profile.camera.transform(x, y)
        for x in (box.xmin, box.xmax)
        for y in (box.ymin, box.ymax)
    ]
    xs, ys = zip(*corners, strict=True)
    up = profile.camera_height
    return Box3D(min(xs), max(xs), min(ys), max(ys), box.zmin + up, box.zmax + up)
