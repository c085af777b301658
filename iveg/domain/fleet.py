"""The fleet as data: its robots, live or recorded, and the profile of each.

``adapters/fleet_files`` reads the files into these values.  A robot without a
description gets the most cautious profile: the largest body, the weakest brakes, and a
camera that proves no spot empty.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS

Kind = Literal["live", "recording"]
Frame = Literal["map", "base_link", "camera_link", "camera_optical_frame"]
"""Frames that a box may be in (REP-105); the last has optical axes (REP-103)."""

ROBOT_ID = re.compile(r"[A-Za-z0-9-]{1,64}")
_NUMBER = re.compile(r"(\d+)")
RESERVED_IDS = frozenset({"climate", "iveg-canary"})
"""Ids of devices that are no robots (docs/interfaces/README.md)."""


def as_counted(robot_id: str) -> tuple[tuple[str, int], ...]:
    """Sort key of an id in the order of people: R2 before R10."""
    parts = _NUMBER.split(robot_id)
    numbers = [int(number) for number in parts[1::2]]
    return tuple(zip(parts[::2], [*numbers, 0], strict=True))


@dataclass(frozen=True, slots=True)
class RobotProfile:
    """Body, drive, camera and laser of a robot; the defaults are the most cautious.

    Attributes:
        drive: ``differential`` (turns on the spot) or ``ackermann``.
        length: Length along x (m).
        width: Width along y (m).
        max_speed: Greatest speed (m/s).
        max_turn: Greatest turn rate (rad/s).
        turning_radius: Least radius (m); 0: it turns on the spot.
        acceleration: Acceleration of the drive (m/s²).
        braking: Deceleration of the drive when it halts (m/s²).
        assumed_braking: Deceleration on which margins rely (m/s²).
        camera: Pose of the camera in ``base_link``.
        camera_height: Height of the camera (m).
        camera_fov: Horizontal field of view (rad); 0: unknown, so that it proves no
            spot empty.
        camera_range: Greatest distance at which it may see (m).
        unlabelled_frame: Frame of boxes that name none; None: unknown.
        camera_frame: Whole name of the camera's frame; None: a usual name.
        laser: Pose of the laser in ``base_link``.
    """

    drive: Literal["differential", "ackermann"] = "differential"
    length: float = 2.0
    width: float = 1.2
    max_speed: float = 1.0
    max_turn: float = 0.5
    turning_radius: float = 0.0
    acceleration: float = 0.5
    braking: float = LIMITS.least_braking_m_s2
    assumed_braking: float = LIMITS.least_braking_m_s2
    camera: Pose2D = Pose2D(0.0, 0.0, 0.0)
    camera_height: float = 0.6
    camera_fov: float = 0.0
    camera_range: float = 15.0
    unlabelled_frame: Frame | None = None
    camera_frame: str | None = None
    laser: Pose2D = Pose2D(0.0, 0.0, 0.0)

    @property
    def has_known_camera(self) -> bool:
        """Whether the pose and the view of the camera are described."""
        return self.camera_fov > 0.0


CAUTIOUS = RobotProfile()
UNDESCRIBED_SPEED = 0.5
"""Greatest speed that the software of a robot without description allows (m/s)."""


@dataclass(frozen=True, slots=True)
class RobotDescription:
    """One robot of the fleet.

    Attributes:
        robot_id: Id of the robot.
        kind: ``recording``: a replay plays it; it never slows or frees a live robot.
        profile: Its profile.
        is_described: Whether it has a description; else the profile is cautious.
        has_detector: Whether its detection frames are required: while they are missing,
            no robot in its reach is clear.
        pose_frame: Frame of odometry that counts as ``map``.
        classes: Names of its detector's classes by number; empty: it sends words.
    """

    robot_id: str
    kind: Kind = "live"
    profile: RobotProfile = CAUTIOUS
    is_described: bool = False
    has_detector: bool = True
    pose_frame: str = "map"
    classes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class FleetDescription:
    """All robots of the fleet by id, in the order of display."""

    members: Mapping[str, RobotDescription] = field(default_factory=dict)

    @classmethod
    def from_robots(cls, robots: Iterable[RobotDescription]) -> "FleetDescription":
        """The fleet of these robots."""
        return cls({robot.robot_id: robot for robot in robots})

    @classmethod
    def undescribed(cls, robot_ids: Iterable[str]) -> "FleetDescription":
        """A fleet of live robots without a description."""
        return cls.from_robots(RobotDescription(robot_id) for robot_id in robot_ids)

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of all robots."""
        return tuple(self.members)

    def of_robot(self, robot_id: str) -> RobotDescription:
        """A robot's description; the most cautious where there is none."""
        return self.members.get(robot_id) or RobotDescription(robot_id)


NOBODY = FleetDescription()
"""A fleet without a description of any robot."""


@lru_cache(maxsize=1024)
def is_robot_id(text: str) -> bool:
    """Whether a text may be the id of a robot."""
    return ROBOT_ID.fullmatch(text) is not None and text not in RESERVED_IDS


def split_word(word: str) -> tuple[str, Kind | None] | None:
    """A robot's id and kind in the short form: ``D1`` or ``D1:recording``.

    Returns:
        None: it is no robot; kind None: the word names no kind.
    """
    robot_id, colon, kind = word.strip().partition(":")
    if not is_robot_id(robot_id):
        return None
    # Without a kind the fleet file decides, or the default.
    if not colon:
        return robot_id, None
    if kind == "live":
        return robot_id, "live"
    return (robot_id, "recording") if kind == "recording" else None
