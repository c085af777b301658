"""Fleet files: TOML and short words in, a checked fleet out.

Members of the fleet are the words of ``IVEG_ROBOTS``, or else all robots of the file
of ``IVEG_FLEET``, or else the built-in robots.  A robot's description comes from the
file, or else from the built-in fleet; a robot may have none.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from iveg.adapters.toml_files import Table, complaint, must, read_table, read_text
from iveg.domain.detector import read_classes
from iveg.domain.errors import UnreadableError
from iveg.domain.fleet import (
    CAUTIOUS,
    FleetDescription,
    Frame,
    Kind,
    RobotDescription,
    is_robot_id,
    split_word,
)
from iveg.domain.geometry import Pose2D


def load_fleet(file: str = "", words: Sequence[str] = ()) -> FleetDescription:
    """Fleet of a file and of short words; both may be missing.

    Args:
        file: Path of a fleet file; empty: the built-in one describes AGI and AGII.
        words: Members, such as ``AGI`` or ``D1:recording``; a kind given here counts
            before the file's.

    Raises:
        DataFileError: the file cannot be used; it names file and key.
    """
    known = built_in() if not file else read_fleet(read_text(file), file)
    if not words:
        return known
    robots = []
    for word in words:
        name, kind = split_word(word) or (word, None)
        robot = known.members.get(name) or built_in().of_robot(name)
        robots.append(robot if kind is None else replace(robot, kind=kind))
    return FleetDescription.from_robots(robots)


@cache
def built_in() -> FleetDescription:
    """The built-in robots: AGI and AGII."""
    return read_fleet(read_text("built-in", {"built-in": "fleet.toml"}), "fleet.toml")


def read_fleet(text: str, file: str) -> FleetDescription:
    """Read a fleet from TOML; ``file`` is its name in complaints.

    Raises:
        DataFileError: naming file, key and reason.
    """
    robots = [row.value() for row in read_table(text, file, _FileTable).robots]
    names = [robot.robot_id for robot in robots]
    for index, name in enumerate(names):
        if name in names[:index]:
            reason = f"{name} is in the list twice"
            raise complaint(file, ("robots", index, "id"), reason)
    return FleetDescription.from_robots(robots)


# --- the shape of the file --------------------------------------------------------


def _classes(text: object) -> object:
    if not isinstance(text, str):
        raise ValueError("must be a text with a name on each line")
    try:
        return read_classes(text)
    except UnreadableError as error:
        raise ValueError(f"{error.reason} has {error.detail}") from error


_Place = Annotated[float, Field(ge=-20, le=20)]
_Angle = Annotated[float, Field(ge=-math.tau, le=math.tau)]
_Metres = Annotated[float, Field(gt=0, le=20)]
_FrameName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_]{1,64}$")]
_Acceleration = Annotated[float, Field(gt=0, le=20)]


class _Body(Table):
    length_m: _Metres
    width_m: _Metres


class _Drive(Table):
    type: Literal["differential", "ackermann"]
    max_speed_m_s: Annotated[float, Field(gt=0, le=10)]
    max_turn_rad_s: Annotated[float, Field(gt=0, le=10)] = CAUTIOUS.max_turn
    turning_radius_m: Annotated[float, Field(ge=0, le=50)] = CAUTIOUS.turning_radius
    acceleration_m_s2: _Acceleration = CAUTIOUS.acceleration
    braking_m_s2: _Acceleration = CAUTIOUS.braking
    assumed_braking_m_s2: _Acceleration | None = None

    @model_validator(mode="after")
    def _assumes_no_stronger_brakes(self) -> Self:
        # The rule counts on the assumed braking: a high value makes too short a way.
        if (self.assumed_braking_m_s2 or 0.0) > self.braking_m_s2:
            raise ValueError("assumed_braking_m_s2 must not be above braking_m_s2")
        return self


class _Mount(Table):
    x_m: _Place = 0.0
    y_m: _Place = 0.0
    yaw_rad: _Angle = 0.0

    def pose(self) -> Pose2D:
        return Pose2D(self.x_m, self.y_m, self.yaw_rad)


class _Camera(_Mount):
    height_m: Annotated[float, Field(gt=0, le=10)] = CAUTIOUS.camera_height
    fov_deg: Annotated[float, Field(gt=0, le=360)]
    range_m: Annotated[float, Field(gt=0, le=100)]
    unlabelled_frame: Frame | None = None
    frame: _FrameName | None = None


class _Robot(Table):
    id: Annotated[str, must(is_robot_id, "must be 1 to 64 letters, digits and hyphens")]
    kind: Kind = "live"
    detector: bool = True
    pose_frame: _FrameName = "map"
    classes: Annotated[tuple[str, ...], BeforeValidator(_classes)] = ()
    body: _Body | None = None
    drive: _Drive | None = None
    camera: _Camera | None = None
    laser: _Mount = _Mount()

    def value(self) -> RobotDescription:
        body, drive, camera = self.body, self.drive, self.camera
        known: dict[str, Any] = {"laser": self.laser.pose()}
        if body is not None:
            known |= {"length": body.length_m, "width": body.width_m}
        if drive is not None:
            known |= {
                "drive": drive.type,
                "max_speed": drive.max_speed_m_s,
                "max_turn": drive.max_turn_rad_s,
                "turning_radius": drive.turning_radius_m,
                "acceleration": drive.acceleration_m_s2,
                "braking": drive.braking_m_s2,
                # Without a value brakes count as no better than the cautious.
                "assumed_braking": drive.assumed_braking_m_s2
                or min(CAUTIOUS.assumed_braking, drive.braking_m_s2),
            }
        if camera is not None:
            known |= {
                "camera": camera.pose(),
                "camera_height": camera.height_m,
                "camera_fov": math.radians(camera.fov_deg),
                "camera_range": camera.range_m,
                "unlabelled_frame": camera.unlabelled_frame,
                "camera_frame": camera.frame,
            }
        return RobotDescription(
            self.id,
            self.kind,
            replace(CAUTIOUS, **known),
            body is not None and drive is not None,
            self.detector,
            self.pose_frame,
            self.classes,
        )


class _FileTable(Table):
    robots: Annotated[list[_Robot], Field(min_length=1, max_length=100)]
