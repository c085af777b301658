"""Fleet files: TOML and short words in, a checked fleet out.

Members of the fleet are the words of ``IVEG_ROBOTS``, or else every robot of the file
of ``IVEG_FLEET``, or else every robot that iVeg itself describes.  The description of
each comes from the file, or else from iVeg's own fleet; a robot may have none.
"""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

from iveg.adapters.toml_positions import place_of, syntax_error
from iveg.domain.errors import DataFileError
from iveg.domain.fleet import (
    CAUTIOUS,
    FleetDescription,
    Frame,
    Kind,
    RobotDescription,
    RobotProfile,
    is_robot_id,
    split_word,
)
from iveg.domain.geometry import Pose2D


def load_fleet(file: str = "", words: Sequence[str] = ()) -> FleetDescription:
    """The fleet of a file and of short words; both may be missing.

    Args:
        file: Path of a fleet file; empty: iVeg's own describes AGI and AGII.
        words: Who is in the fleet, such as ``AGI`` or ``D1:recording``; a kind that is
            said here counts before that of the file.

    Raises:
        DataFileError: the file cannot be used; it says file, line and column.
    """
    known = built_in() if not file else _load(file)
    if not words:
        return known
    robots = []
    for word in words:
        name, kind = split_word(word) or (word, None)
        one = known.members.get(name) or built_in().of_robot(name)
        robots.append(one if kind is None else replace(one, kind=kind))
    return FleetDescription.of(robots)


@cache
def built_in() -> FleetDescription:
    """The built-in robots: AGI and AGII."""
    text = (resources.files("iveg") / "data" / "fleet.toml").read_text("utf-8")
    return read_fleet(text, "fleet.toml")


def _load(file: str) -> FleetDescription:
    try:
        text = Path(file).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = f"cannot be read as text in UTF-8: {error}."
        raise DataFileError(file, "", reason) from error
    return read_fleet(text, file)


def read_fleet(text: str, file: str) -> FleetDescription:
    """Read a fleet from TOML; ``file`` is its name in complaints.

    Raises:
        DataFileError: naming file, line, column, key and reason.
    """
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line, column, why = syntax_error(error, text)
        reason = f"is not TOML: {why}."
        raise DataFileError(f"{file}:{line}:{column}", "", reason) from error
    try:
        page = _FileTable.model_validate(raw)
    except ValidationError as error:
        complaints = error.errors(include_input=False, include_url=False)
        # A key that was mistyped says more than that the right one is missing.
        first = min(complaints, key=lambda one: one["type"] != "extra_forbidden")
        raise _complaint(text, file, first["loc"], first["msg"]) from error
    robots = [one.value() for one in page.robots]
    names = [one.robot_id for one in robots]
    for index, name in enumerate(names):
        if name in names[:index]:
            path = ("robots", index, "id")
            raise _complaint(text, file, path, f"{name} is in the list twice")
    return FleetDescription.of(robots)


def _complaint(
    text: str, file: str, path: tuple[str | int, ...], reason: str
) -> DataFileError:
    line, column = place_of(text, path)
    key = "".join(f"[{one}]" if isinstance(one, int) else f".{one}" for one in path)
    said = reason.removeprefix("Value error, ")
    return DataFileError(f"{file}:{line}:{column}", key.lstrip("."), f"{said}.")


# --- the shape of the file --------------------------------------------------------


def _checked_id(text: str) -> str:
    if not is_robot_id(text):
        raise ValueError("must be 1 to 64 letters, digits and hyphens")
    return text


_Place = Annotated[float, Field(ge=-20, le=20)]
_Angle = Annotated[float, Field(ge=-math.tau, le=math.tau)]
_Metres = Annotated[float, Field(gt=0, le=20)]
_Acceleration = Annotated[float, Field(gt=0, le=20)]


class _Table(BaseModel):
    # A number may be written without a point; a text is no number.
    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True
    )


class _Body(_Table):
    length_m: _Metres
    width_m: _Metres


class _Drive(_Table):
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


class _Camera(_Table):
    x_m: _Place = 0.0
    y_m: _Place = 0.0
    yaw_rad: _Angle = 0.0
    height_m: Annotated[float, Field(gt=0, le=10)] = CAUTIOUS.camera_height
    fov_deg: Annotated[float, Field(gt=0, le=360)]
    range_m: Annotated[float, Field(gt=0, le=100)]
    unlabelled_frame: Frame | None = None


class _Laser(_Table):
    x_m: _Place = 0.0
    y_m: _Place = 0.0
    yaw_rad: _Angle = 0.0


class _Robot(_Table):
    id: Annotated[str, AfterValidator(_checked_id)]
    kind: Kind = "live"
    detector: bool = True
    body: _Body | None = None
    drive: _Drive | None = None
    camera: _Camera | None = None
    laser: _Laser = _Laser()

    def value(self) -> RobotDescription:
        profile, body, drive, camera = CAUTIOUS, self.body, self.drive, self.camera
        if body is not None:
            profile = replace(profile, length=body.length_m, width=body.width_m)
        if drive is not None:
            profile = _driven(profile, drive)
        if camera is not None:
            profile = replace(
                profile,
                camera=Pose2D(camera.x_m, camera.y_m, camera.yaw_rad),
                camera_height=camera.height_m,
                camera_fov=math.radians(camera.fov_deg),
                camera_range=camera.range_m,
                unlabelled_frame=camera.unlabelled_frame,
            )
        laser = self.laser
        profile = replace(profile, laser=Pose2D(laser.x_m, laser.y_m, laser.yaw_rad))
        is_described = body is not None and drive is not None
        return RobotDescription(
            self.id, self.kind, profile, is_described, self.detector
        )


def _driven(profile: RobotProfile, drive: _Drive) -> RobotProfile:
    assumed = drive.assumed_braking_m_s2
    return replace(
        profile,
        drive=drive.type,
        max_speed=drive.max_speed_m_s,
        max_turn=drive.max_turn_rad_s,
        turning_radius=drive.turning_radius_m,
        acceleration=drive.acceleration_m_s2,
        braking=drive.braking_m_s2,
        assumed_braking=assumed or min(CAUTIOUS.assumed_braking, drive.braking_m_s2),
    )


class _FileTable(_Table):
    robots: Annotated[list[_Robot], Field(min_length=1, max_length=100)]
