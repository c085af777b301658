"""Base of all models, and what many are made of: moments, places (m), scans."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final, Generic, Self, TypeVar

import orjson
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    WrapValidator,
    create_model,
)

from iveg.domain.geometry import Twist2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.records import SHOWN_COLUMNS, Column
from iveg.domain.stamps import format_stamp

Slots = dict[str, str | bool | int | float | None]
"""Values of the ``{named}`` placeholders of a sentence."""


class Model(BaseModel):
    """Base of all resources; lengths in metres, angles in radians, ages in seconds."""

    model_config = ConfigDict(
        frozen=True,
        from_attributes=True,
        extra="forbid",
        serialize_by_alias=True,
        validate_by_alias=True,
        validate_by_name=True,
    )

    @classmethod
    def from_value(cls, source: object, **other: Any) -> Self:
        """Make it of a value whose members have its names; ``other`` has the rest."""
        if not other:
            return cls.model_validate(source)
        named = {
            name: getattr(source, name)
            for name in cls.model_fields
            if name not in other and hasattr(source, name)
        }
        return cls(**named, **other)


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


def stamp(at: Instant | float | None) -> str | None:
    """An instant or Unix seconds as ISO-8601 UTC with milliseconds."""
    if at is None:
        return None
    return format_stamp(at.wall if isinstance(at, Instant) else at)


def rounded(value: float | None, digits: int = 3) -> float | None:
    """A number with no more decimals than it can mean."""
    return None if value is None else round(value, digits)


def _stamped(at: Any) -> object:
    return at if isinstance(at, str) else stamp(at)


def _whole_or_none(value: object, read: Callable[[object], object]) -> object:
    try:
        return read(value)
    except ValidationError:
        return None


Stamp = Annotated[str, BeforeValidator(_stamped)]
"""A moment, of an instant or of Unix seconds."""
Tenth = Annotated[float, AfterValidator(partial(round, ndigits=1))]
Hundredth = Annotated[float, AfterValidator(partial(round, ndigits=2))]
Thousandth = Annotated[float, AfterValidator(partial(round, ndigits=3))]
OR_NONE: Final = WrapValidator(_whole_or_none)
"""A value that is not whole, as of a damaged row, reads as None."""


class Row(Model):
    """A row of the history, with a key for each column of its record (``row_of``)."""

    if TYPE_CHECKING:

        def __getattr__(self, key: str) -> Any:
            """The value of a column."""

    @classmethod
    def from_record(cls, record: Any) -> Self:
        """As it was kept."""
        return cls.from_value(record)


RowModel = TypeVar("RowModel", bound=Row)


def row_of(kind: type, *without: str) -> Callable[[type[RowModel]], type[RowModel]]:
    """Give a model the columns of a record that it does not declare itself.

    Args:
        kind: The record.
        without: Columns that it does not have.
    """

    def give(model: type[RowModel]) -> type[RowModel]:
        keys: dict[str, Any] = {
            _key(one): (_type(one), _field(one))
            for one in SHOWN_COLUMNS[kind]
            if _key(one) not in (*model.model_fields, *without)
        }
        return create_model(
            model.__name__,
            __base__=model,
            __doc__=model.__doc__,
            __module__=model.__module__,
            **keys,
        )

    return give


def _key(column: Column) -> str:
    return column.key if column.transport is None else column.name


def _type(column: Column) -> Any:
    if column.type != "time":
        return column.hint
    return Stamp | None if column.may_lack else Stamp


def _field(column: Column) -> Any:
    meaning = column.meaning
    text = meaning.means
    if meaning.unit:
        text = f"{text.removesuffix('.')} ({meaning.unit})."
    if column.name == column.key:
        return Field(description=text)
    return Field(description=text, alias=column.name)


class Point(Model):
    """A place in ``map`` (m)."""

    x: float
    y: float


class Position(Model):
    """A place in ``map`` with its height (m)."""

    x: float
    y: float
    z: float


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
    def of(cls, greenhouse: Greenhouse) -> Self:
        """The greenhouse that is supervised."""
        lanes = [Lane.from_value(one.area, label=one.label) for one in greenhouse.lanes]
        obstacles = [
            Obstacle.from_value(one.area, kind=one.kind) for one in greenhouse.obstacles
        ]
        return cls.from_value(greenhouse, lanes=lanes, obstacles=obstacles)


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

    All robots' scans, with the zones of people and moving peers laid over; or what one
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

    A camera looks where it would take a zone away: LIVE, within three quarters of its
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


class Twist(Model):
    """Speed (m/s) and turn rate (rad/s).

    Attributes:
        linear: Forward (m/s).
        angular: Turn rate (rad/s).
    """

    linear: float
    angular: float

    @classmethod
    def of(cls, twist: Twist2D) -> Self:
        """As the robot measured it."""
        return cls(linear=twist.linear_x, angular=twist.angular_z)
