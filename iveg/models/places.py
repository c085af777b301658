"""Places in ``map``: points, boxes and the greenhouse (m)."""

from dataclasses import asdict

from iveg.domain.greenhouse import Greenhouse
from iveg.domain.records import DecisionRecord, DetectionRecord
from iveg.models.base import Model


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
    """A rectangle along the axes of ``map`` (m)."""

    xmin: float
    ymin: float
    xmax: float
    ymax: float


class Lane(Area):
    """A lane of the greenhouse."""

    label: str


class Obstacle(Area):
    """An obstacle."""

    kind: str


class Post(Model):
    """A round thing (m)."""

    x: float
    y: float
    radius: float


class GreenhouseMap(Model):
    """The greenhouse as the page draws it."""

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
