"""Parts of a scenario: scripts of robots, rounds of people, incidents."""

from collections.abc import Mapping
from dataclasses import dataclass

from iveg.domain.geometry import Pose2D
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.people import WalkStop
from iveg.lab.emulator.routes import Route, Station, route_of

TESTBED = "mvsim-20x20"
"""The greenhouse that most scenarios are written for."""


@dataclass(frozen=True, slots=True)
class RobotScript:
    """Start and route of one robot.

    Attributes:
        corners: Of its route, rounded with ``radius`` (m).
        closed: A closed route; otherwise back and forth.
        cruise: (m/s).
        task: Its reported task.
    """

    start: Pose2D
    corners: tuple[tuple[float, float], ...]
    radius: float
    task: str
    closed: bool = True
    cruise: float = 0.8
    stations: tuple[Station, ...] = ()

    def route(self) -> Route:
        """The route as points."""
        return route_of(self.corners, self.radius, self.closed)


@dataclass(frozen=True, slots=True)
class Incident:
    """A fault injected during a run.

    Attributes:
        at_s: Seconds into the run; again every ``every_s`` where that is not 0.
        order: The fault.
    """

    at_s: float
    order: FaultOrder
    every_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Scenario:
    """One named run.

    Attributes:
        about: Purpose in one sentence.
        outcome: Expected outcome in iVeg; checked by a test of the whole stack.
        robots: Scripts by robot id; a fleet with other ids uses the route of ``many``.
        people: Stops of each person.
        detector: Replaces the requested detector profile.
        greenhouse: The greenhouse that it is written for.
    """

    name: str
    about: str
    outcome: str
    robots: Mapping[str, RobotScript]
    people: tuple[tuple[WalkStop, ...], ...] = ()
    incidents: tuple[Incident, ...] = ()
    detector: str | None = None
    greenhouse: str = TESTBED
