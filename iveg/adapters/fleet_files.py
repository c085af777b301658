"""Fleet files: TOML and short words in, a checked fleet out.

Members of the fleet are the words of ``IVEG_ROBOTS``, or else every robot of the file
of ``IVEG_FLEET``, or else every robot that iVeg itself describes.  The description of
each comes from the file, or else from iVeg's own fleet; a robot may have none.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    model_validator,
)

from iveg.adapters.toml_files import Table, complaint, read_table, read_text
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
from iveg.domain.words import read_classes


def load_fleet(file: str = "", words: Sequence[str] = ()) -> FleetDescription:
    """The fleet of a file and of short words; both may be missing.

    Args:
        file: Path of a fleet file; empty: iVeg's own describes AGI and AGII.
        words: Who is in the fleet, such as ``AGI`` or ``D1:recording``; a kind that is
            said here counts before that of the file.

    Raises:
        DataFileError: the file cannot be used; it says file and key.
    """
    known = built_in() if not file else read_fleet(read_text(file), file)
    if not words:
        return known
    robots = []
    for word in words:
        name, kind = split_word(word) or (word, None)
        robot = known.members.get(name) or built_in().of_robot(name)
        robots.append(robot if kind is None else replace(robot, kind=kind))
    return FleetDescription.of(robots)


@cache
def built_in() -> FleetDescription:
    """The built-in robots: AGI and AGII."""
    return read_fleet(read_text("built-in", {"built-in": "fleet.toml"}), "fleet.toml")


def read_fleet(text: str, file: str) -> FleetDescription:
    """Read a fleet from TOML; ``file`` is its name in complaints.

    Raises:
        DataFileError: naming file, key and reason.
    """
    page = read_table(text, file, _FileTable)
    robots = [row.value() for row in page.robots]
    names = [robot.robot_id for robot in robots]
    for index, name in enumerate(names):
        if name in names[:index]:
            reason = f"{name} is in the list twice"
            raise complaint(file, ("robots", index, "id"), reason)
    return FleetDescription.of(robots)


# --- the shape of the file --------------------------------------------------------


def _checked_id(text: str) -> str:
    if not is_robot_id(text):
        raise ValueError("must be 1 to 64 letters, digits and hyphens")
    return text


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
    def _not_more_than_it_does(self) -> Self:
        if (self.assumed_braking_m_s2 or 0.0) > self.braking_m_s2:
            raise ValueError("assumed_braking_m_s2 must not be above braking_m_s2")
        return self


class _Camera(Table):
    x_m: _Place = 0.0
    y_m: _Place = 0.0
    yaw_rad: _Angle = 0.0
    height_m: Annotated[float, Field(gt=0, le=10)] = CAUTIOUS.camera_height
    fov_deg: Annotated[float, Field(gt=0, le=360)]
    range_m: Annotated[float, Field(gt=0, le=100)]
    unlabelled_frame: Frame | None = None
    frame: _FrameName | None = None


class _Laser(Table):
    x_m: _Place = 0.0
    y_m: _Place = 0.0
    yaw_rad: _Angle = 0.0


class _Robot(Table):
    id: Annotated[str, AfterValidator(_checked_id)]
    kind: Kind = "live"
    detector: bool = True
    pose_frame: _FrameName = "map"
    classes: Annotated[tuple[str, ...], BeforeValidator(_classes)] = ()
    body: _Body | None = None
    drive: _Drive | None = None
    camera: _Camera | None = None
    laser: _Laser = _Laser()

    def value(self) -> RobotDescription:
        body, drive, camera, laser = self.body, self.drive, self.camera, self.laser
        known: dict[str, Any] = {"laser": Pose2D(laser.x_m, laser.y_m, laser.yaw_rad)}
        if body is not None:
            known |= {"length": body.length_m, "width": body.width_m}
        if drive is not None:
            least = min(CAUTIOUS.assumed_braking, drive.braking_m_s2)
            known |= {
                "drive": drive.type,
                "max_speed": drive.max_speed_m_s,
                "max_turn": drive.max_turn_rad_s,
                "turning_radius": drive.turning_radius_m,
                "acceleration": drive.acceleration_m_s2,
                "braking": drive.braking_m_s2,
                "assumed_braking": drive.assumed_braking_m_s2 or least,
            }
        if camera is not None:
            known |= {
                "camera": Pose2D(camera.x_m, camera.y_m, camera.yaw_rad),
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
