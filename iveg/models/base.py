"""Base of all models: frozen, only declared fields, encoded by orjson.

Places in ``map``: points, boxes and the greenhouse (m).

What lasers and cameras have mapped: scans, the costmap, covered aisles (m).

Stored readings of small sensors of robots.

Where a robot is and how it moves, in ``map``.
"""

from dataclasses import asdict
from typing import Generic, TypeVar

import orjson
from pydantic import BaseModel, ConfigDict, Field, JsonValue

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.records import DecisionRecord, DetectionRecord, ReadingRecord
from iveg.domain.stamps import format_stamp

Slots = dict[str, str | bool | int | float | None]
"""Values of the ``{named}`` placeholders of a sentence."""


class Model(BaseModel):
    """Base of all resources; lengths in metres, angles in radians, ages in seconds."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        serialize_by_alias=True,
        validate_by_alias=True,
        validate_by_name=True,
    )


class Body(BaseModel):
    """Base of what a request brings: each value of its own kind, and nothing else."""

    model_config = ConfigDict(strict=True, extra="forbid")


M = TypeVar("M", bound=Model)


class Listing(Model, Generic[M]):
    """One page of a list; ``next`` is the cursor of the page after it."""

    items: list[M]
    next: str | None = None


def write_json(value: object) -> bytes:
    """Models, and whatever holds them, as JSON."""
    return orjson.dumps(value, default=_plain)


def _plain(value: object) -> object:
    if isinstance(value, Model):
        return orjson.Fragment(value.model_dump_json())
    raise TypeError(type(value).__name__)


def moment(at: Instant | None) -> str | None:
    """An instant as ISO-8601 UTC with milliseconds."""
    return None if at is None else format_stamp(at.wall)


def stamp(wall: float | None) -> str | None:
    """Unix seconds as ISO-8601 UTC with milliseconds."""
    return None if wall is None else format_stamp(wall)


def rounded(value: float | None, digits: int = 3) -> float | None:
    """A number with no more decimals than it can mean."""
    return None if value is None else round(value, digits)


class Point(Model):
    """A place in ``map`` (m)."""

    x: float
    y: float


class Position(Model):
    """A place in ``map`` with its height (m)."""

    x: float
    y: float
    z: float

    @classmethod
    def of_record(cls, record: DecisionRecord | DetectionRecord) -> "Position | None":
        """The place of a row; None where it was not known."""
        if record.x is None or record.y is None:
            return None
        return cls(x=record.x, y=record.y, z=record.z or 0.0)


class Area(Model):
    """A rectangle along the axes of ``map`` (m).

    Attributes:
        xmin: Sides (m).
        ymin: Sides (m).
        xmax: Sides (m).
        ymax: Sides (m).
    """

    xmin: float
    ymin: float
    xmax: float
    ymax: float


class Lane(Area):
    """A lane of the greenhouse.

    Attributes:
        label: Its name.
    """

    label: str


class Obstacle(Area):
    """An obstacle.

    Attributes:
        kind: What it is.
    """

    kind: str


class Post(Model):
    """A round thing (m).

    Attributes:
        x: Centre (m).
        y: Centre (m).
        radius: Radius (m).
    """

    x: float
    y: float
    radius: float


class GreenhouseMap(Model):
    """The greenhouse as the page draws it.

    Attributes:
        name: Its name.
        bounds: Walls (m).
        lanes: Aisles (m).
        rows: Crop rows (m).
        posts: Round obstacles (m).
        obstacles: What else stands in the way (m).
    """

    name: str
    bounds: Area
    lanes: list[Lane]
    rows: list[Area]
    posts: list[Post]
    obstacles: list[Obstacle]

    @classmethod
    def of(cls, greenhouse: Greenhouse) -> "GreenhouseMap":
        """The greenhouse that is supervised."""
        return cls(
            name=greenhouse.name,
            bounds=Area(**asdict(greenhouse.bounds)),
            lanes=[
                Lane(label=lane.label, **asdict(lane.area)) for lane in greenhouse.lanes
            ],
            rows=[Area(**asdict(row)) for row in greenhouse.rows],
            posts=[Post(**asdict(post)) for post in greenhouse.posts],
            obstacles=[
                Obstacle(kind=one.kind, **asdict(one.area))
                for one in greenhouse.obstacles
            ],
        )


class Scan(Model):
    """One sweep: points in ``map`` (m).

    Attributes:
        robot_id: Whose.
        stamp: As the robot sent it.
        frame_id: ``map``.
        points: Where something came back (m).
    """

    robot_id: str
    stamp: str | None
    frame_id: str = "map"
    points: list[tuple[float, float]]


class Costmap(Model):
    """Cells from the south-western corner, row by row: 0-100, -1 unknown.

    All robots' scans, with the rings of people and moving peers laid over; or what one
    robot believes: its own scans, and the people and peers of whom feedback told it.

    Attributes:
        width: ``width`` is 0 before the first scan (cells).
        height: ``width`` is 0 before the first scan (cells).
        origin: South-western corner (m).
        data: Rows from the south-western corner: 0 free … 100 taken, −1 unknown.
    """

    resolution: float = Field(description="Metres a cell.")
    width: int
    height: int
    origin: Point
    data: list[int]
    age_s: float | None = Field(
        default=None, description="Since the newest scan in it; null before the first."
    )


class LaneCoverage(Area):
    """One aisle in cells: rows from the south, each from west to east.

    Attributes:
        label: The aisle.
        columns: Its size (cells).
        rows: Its size (cells).
    """

    label: str
    columns: int
    rows: int
    ages_s: list[int | None] = Field(
        description="Whole seconds since a camera last covered a cell; null: never."
    )


class Coverage(Model):
    """When a camera last looked at each cell of the aisles.

    A camera looks where it would take a ring away: LIVE, within three quarters of its
    reach, nothing in between.

    Attributes:
        at: When.
        within_s: 10 (s).
        lanes: One for each aisle.
    """

    at: str
    cameras: int = Field(description="Number of working cameras.")
    within_s: float
    share: float | None = Field(
        description=(
            "Share of the cells covered within that time (0-1); null without aisles."
        )
    )
    lanes: list[LaneCoverage]


class Reading(Model):
    """One reading: the sensor's own fields by name.

    Attributes:
        at: When.
        robot_id: Whose.
        kind: Name of a small sensor ([mqtt.md](mqtt.md)), such as ``battery``.
        value: Its keys without the origin.
    """

    at: str
    robot_id: str
    kind: str
    value: dict[str, JsonValue]

    @classmethod
    def of_record(cls, record: ReadingRecord) -> "Reading":
        """As it was kept."""
        return cls(
            at=format_stamp(record.at),
            robot_id=record.robot_id,
            kind=record.kind,
            value=dict(record.value or {}),
        )


class Pose(Model):
    """Pose of ``base_link`` in ``map``.

    Attributes:
        x: Position (m).
        y: Position (m).
        yaw: Heading (rad).
    """

    x: float
    y: float
    yaw: float

    @classmethod
    def of(cls, pose: Pose2D) -> "Pose":
        """As the robot measured it."""
        return cls(x=pose.x, y=pose.y, yaw=pose.yaw)


class Twist(Model):
    """Speed (m/s) and turn rate (rad/s).

    Attributes:
        linear: Forward (m/s).
        angular: Turn rate (rad/s).
    """

    linear: float
    angular: float

    @classmethod
    def of(cls, twist: Twist2D) -> "Twist":
        """As the robot measured it."""
        return cls(linear=twist.linear_x, angular=twist.angular_z)
