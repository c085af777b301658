"""Objects that a detector may detect."""

from dataclasses import dataclass, replace

from iveg.domain.geometry import PERSON_HEIGHT_M, Pose2D
from iveg.lab.emulator.detector_model import PERSON
from iveg.lab.emulator.greenhouse import Body, Disc

ROBOT_HEIGHT_M = 1.2


_THING_RADIUS_M = 0.2


@dataclass(frozen=True, slots=True)
class Target:
    """An object that a detector may detect.

    Attributes:
        key: Unique id.
        class_id: As the paper's detector names it.
        body: Its outline; a person's is a square.
    """

    key: str
    class_id: str
    body: Body
    height: float


def person_target(number: int, person: Disc) -> Target:
    """A person as a target."""
    pose, size = Pose2D(person.x, person.y, 0.0), 2 * person.radius
    body = Body(f"person-{number}", pose, size, size)
    return Target(body.robot_id, PERSON, body, PERSON_HEIGHT_M)


def thing_target(x: float, y: float) -> Target:
    """A post or coat at a position in ``map`` (m), which is taken for a person."""
    return replace(person_target(0, Disc(x, y, _THING_RADIUS_M)), key="thing")


def robot_target(body: Body) -> Target:
    """A robot as a target: the class is its id, as in the paper."""
    return Target(body.robot_id, body.robot_id, body, ROBOT_HEIGHT_M)
