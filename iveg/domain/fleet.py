"""The fleet as data: its robots, live or recorded, and the profile of each.

Files are read in ``adapters/fleet_files``; here are the values.  A robot without a
description gets the most cautious profile: the largest body, the weakest brakes, and a
camera that can clear no spot.
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
    """Sorts names as people count: R2 before R10."""
    parts = _NUMBER.split(robot_id)
    numbers = [int(number) for number in parts[1::2]]
    return tuple(zip(parts[::2], [*numbers, 0], strict=True))


@dataclass(frozen=True, slots=True)
class RobotProfile:
    """Body, drive, camera and laser of a robot; the defaults are the most cautious.

    Attributes:
        drive: ``differential`` (turns on the spot) or ``ackermann``.
        length: Along x (m); ``width`` along y (m).
        max_speed: What it may drive at most (m/s); ``max_turn`` (rad/s).
        turning_radius: Least radius (m); 0 for one that turns on the spot.
        acceleration: (m/s²); ``braking`` (m/s²) what the drive does when asked to halt.
        assumed_braking: What margins may count on (m/s²).
        camera: Pose of the camera in ``base_link``; ``camera_height`` (m).
        camera_fov: What the camera sees across (rad); 0: nobody knows, so that a spot
            is never taken for empty.
        camera_range: How far it may see (m).
        unlabelled_frame: The frame of boxes that come without one; None: nobody knows.
        camera_frame: Whole name of the camera's frame; None: a usual one.
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
        """Whether somebody said where the camera is and what it sees."""
        return self.camera_fov > 0.0


CAUTIOUS = RobotProfile()
UNDESCRIBED_SPEED = 0.5
"""Greatest speed that the software of a robot without description allows (m/s)."""


@dataclass(frozen=True, slots=True)
class RobotDescription:
    """One robot of the fleet.

    Attributes:
        kind: ``recording``: a replay plays it; it never slows or frees a live robot.
        has_detector: Whether its detection frames are waited for: while they are
            missing, nobody in its reach is clear.
        is_described: Whether somebody said what it is; else the profile is cautious.
        classes: Names of its detector's classes by number; none: it says words.
        pose_frame: Frame in which its odometry tells where it is in the greenhouse.
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
    """Every robot of the fleet, by id, in the order that people see."""

    members: Mapping[str, RobotDescription] = field(default_factory=dict)

    @classmethod
    def of(cls, robots: Iterable[RobotDescription]) -> "FleetDescription":
        """The fleet of these robots."""
        return cls({robot.robot_id: robot for robot in robots})

    @classmethod
    def undescribed(cls, robot_ids: Iterable[str]) -> "FleetDescription":
        """Live robots of which nothing but the id is known."""
        return cls.of(RobotDescription(robot_id) for robot_id in robot_ids)

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of all robots."""
        return tuple(self.members)

    def of_robot(self, robot_id: str) -> RobotDescription:
        """A robot's description; the most cautious where there is none."""
        return self.members.get(robot_id) or RobotDescription(robot_id)


NOBODY = FleetDescription()
"""A fleet of which nothing is known."""


@lru_cache(maxsize=1024)
def is_robot_id(text: str) -> bool:
    """Whether a robot may be called so."""
    return ROBOT_ID.fullmatch(text) is not None and text not in RESERVED_IDS


def split_word(word: str) -> tuple[str, Kind | None] | None:
    """A robot's id and kind in the short form: ``D1`` or ``D1:recording``.

    Returns:
        None where it is neither; kind None where the word says none.
    """
    robot_id, colon, kind = word.strip().partition(":")
    if not is_robot_id(robot_id):
        return None
    if not colon:
        return robot_id, None
    if kind == "live":
        return robot_id, "live"
    return (robot_id, "recording") if kind == "recording" else None
