"""Base of all models, and parts that many share: moments, places (m), scans."""

import inspect
import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Final,
    Generic,
    Self,
    TypeVar,
    get_type_hints,
)

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

from iveg.domain.geometry import Pose2D, Rectangle, Twist2D
from iveg.domain.greenhouse import Greenhouse, StructuralPost
from iveg.domain.observations import Instant
from iveg.domain.records import SHOWN_COLUMNS, Column
from iveg.domain.stamps import format_stamp

Slots = dict[str, str | bool | int | float | None]
"""Values of the ``{named}`` placeholders of a sentence."""


_MEANING: Final = re.compile(r"^    (\w+): (.*(?:\n {8}.*)*)", re.M)
"""A row below "Attributes" in a docstring."""


def describe(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Describe the keys of a JSON schema by the "Attributes" of its model."""
    meanings: dict[str, str] = {}
    # The model itself comes last, so that its words replace those of its bases.
    for base in reversed(model.__mro__):
        doc = inspect.cleandoc(base.__doc__ or "")
        schema["description"], _, rows = doc.partition("\n\nAttributes:")
        meanings |= dict(_MEANING.findall(rows))
    for name, about in model.model_fields.items():
        shown = schema["properties"][about.serialization_alias or name]
        if name in meanings:
            shown["description"] = in_line(meanings[name])


def in_line(text: str) -> str:
    """A docstring's text in Markdown, on one line."""
    return " ".join(text.replace("``", "`").split())


class Model(BaseModel):
    """Base of all resources; lengths in metres, angles in radians, ages in seconds.

    A field's meaning and unit stand below "Attributes" in the docstring of its model.
    """

    model_config = ConfigDict(
        json_schema_extra=describe,
        frozen=True,
        from_attributes=True,
        extra="forbid",
        serialize_by_alias=True,
        # Python's own words, such as ``class``, are aliases: both names can be given.
        validate_by_alias=True,
        validate_by_name=True,
    )

    @classmethod
    def from_value(cls, source: object, **other: Any) -> Self:
        """Read fields from attributes of the same names; ``other`` has the rest."""
        if not other:
            return cls.model_validate(source)
        named = {
            name: getattr(source, name)
            for name in cls.model_fields
            if name not in other and hasattr(source, name)
        }
        return cls(**named, **other)


class Body(BaseModel):
    """Base of request bodies: strict types, and no unknown members."""

    model_config = ConfigDict(strict=True, extra="forbid")


AModel = TypeVar("AModel", bound=BaseModel)


def with_fields(
    fields: Mapping[str, Any],
) -> Callable[[type[AModel]], type[AModel]]:
    """Decorate a model with the fields of a table, each a type and a ``Field``."""

    def give(model: type[AModel]) -> type[AModel]:
        return create_model(
            model.__name__,
            __base__=model,
            __doc__=model.__doc__,
            __module__=model.__module__,
            **fields,
        )

    return give


def members_of(kind: type, *names: str) -> Callable[[type[AModel]], type[AModel]]:
    """Decorate a model with members of a domain value, under their types there."""
    hints = get_type_hints(kind)
    return with_fields({name: (hints[name], ...) for name in names})


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
        # Pydantic's own writer applies the aliases, which orjson does not know.
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
"""A moment; accepts an instant, Unix seconds, or text that is a stamp already."""
Tenth = Annotated[float, AfterValidator(partial(round, ndigits=1))]
Hundredth = Annotated[float, AfterValidator(partial(round, ndigits=2))]
Thousandth = Annotated[float, AfterValidator(partial(round, ndigits=3))]
OR_NONE: Final = WrapValidator(_whole_or_none)
"""A value that cannot be read, as of a damaged row, is None."""


class Row(Model):
    """A row of the history, with a key for each column of its record (``row_of``)."""

    # Columns are added at run time, where a type checker does not see them.
    if TYPE_CHECKING:

        def __getattr__(self, key: str) -> Any:
            """The value of a column."""

    @classmethod
    def from_record(cls, record: Any) -> Self:
        """A row as the history kept it."""
        return cls.from_value(record)


RowModel = TypeVar("RowModel", bound=Row)


def row_of(kind: type, *without: str) -> Callable[[type[RowModel]], type[RowModel]]:
    """Decorate a model with the columns of a record that it does not declare itself.

    Args:
        kind: The record.
        without: Columns that it does not have.
    """

    def give(model: type[RowModel]) -> type[RowModel]:
        keys: dict[str, Any] = {
            _key(column): (_type(column), _field(column))
            for column in SHOWN_COLUMNS[kind]
            if _key(column) not in (*model.model_fields, *without)
        }
        return with_fields(keys)(model)

    return give


def _key(column: Column) -> str:
    # Columns of one transport share their key; only the name tells them apart.
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


@members_of(Rectangle, "xmin", "ymin", "xmax", "ymax")
class Area(Model):
    """A rectangle along the axes of ``map`` (m).

    Attributes:
        xmin: Sides (m).
        ymin: Sides (m).
        xmax: Sides (m).
        ymax: Sides (m).
    """


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


@members_of(StructuralPost, "x", "y", "radius")
class Post(Model):
    """A round thing (m).

    Attributes:
        x: Centre (m).
        y: Centre (m).
        radius: Radius (m).
    """


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
    def from_greenhouse(cls, greenhouse: Greenhouse) -> Self:
        """The greenhouse that is supervised."""
        lanes = [
            Lane.from_value(lane.area, label=lane.label) for lane in greenhouse.lanes
        ]
        obstacles = [
            Obstacle.from_value(obstacle.area, kind=obstacle.kind)
            for obstacle in greenhouse.obstacles
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

    All robots' scans, with the zones of people and moving peers laid over; or one
    robot's own scans, with the people and peers of its feedback.

    Attributes:
        resolution: Metres a cell.
        width: ``width`` is 0 before the first scan (cells).
        height: ``width`` is 0 before the first scan (cells).
        origin: South-western corner (m).
        data: Rows from the south-western corner: 0 free … 100 taken, −1 unknown.
        age_s: Since the newest scan in it; null before the first.
    """

    resolution: float
    width: int
    height: int
    origin: Point
    data: list[int]
    age_s: float | None = None


class LaneCoverage(Area):
    """One aisle in cells: rows from the south, each from west to east.

    Attributes:
        label: The aisle.
        columns: Its size (cells).
        rows: Its size (cells).
        ages_s: Whole seconds since a camera last covered a cell; null: never.
    """

    label: str
    columns: int
    rows: int
    ages_s: list[int | None]


class Coverage(Model):
    """Time of the last view of each cell of the aisles.

    In view is a place where the camera could end a zone: LIVE, within three quarters of
    its reach, nothing in between.

    Attributes:
        at: When.
        cameras: Number of working cameras.
        within_s: 10 (s).
        share: Share of the cells covered within that time (0-1); null without aisles.
        lanes: One for each aisle.
    """

    at: str
    cameras: int
    within_s: float
    share: float | None
    lanes: list[LaneCoverage]


@members_of(Pose2D, "x", "y", "yaw")
class Pose(Model):
    """Pose of ``base_link`` in ``map``.

    Attributes:
        x: Position (m).
        y: Position (m).
        yaw: Heading (rad).
    """


class Twist(Model):
    """Speed (m/s) and turn rate (rad/s).

    Attributes:
        linear: Forward (m/s).
        angular: Turn rate (rad/s).
    """

    linear: float
    angular: float

    @classmethod
    def from_twist(cls, twist: Twist2D) -> Self:
        """As the robot measured it."""
        return cls(linear=twist.linear_x, angular=twist.angular_z)
