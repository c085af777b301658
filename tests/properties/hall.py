"""A bare hall with one robot, whose laser and camera tell the truth about people."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse, StructuralPost
from iveg.domain.observations import LaserScan
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.laser_sight import LaserSight
from iveg.domain.witness import Plan
from iveg.lab.emulator.greenhouse import Disc, Scenery
from iveg.lab.emulator.lidar import LaserModel, sweep
from tests.builders import at, scan
from tests.unit.domain.scene import Scene, person

HALL = Greenhouse(
    "hall",
    Rectangle(-12.0, -12.0, 12.0, 12.0),
    posts=(StructuralPost(-11.0, -11.0, 0.1),),
)
MODEL = LaserModel()
TICK_S = 0.1
_OFF_M = 0.8
Place = tuple[float, float]
Walk = tuple[Place, list[Place]]
"""Where somebody is, and where they go from there, one place after the other."""
_PLACES = st.tuples(st.floats(-7.0, 7.0), st.floats(-5.0, 5.0))
WALKS = st.tuples(_PLACES, st.lists(_PLACES, min_size=1, max_size=4))


class Hall(Scene):
    """AGI stands or drives in the middle; its laser and its camera tell the truth."""

    def __init__(self) -> None:
        super().__init__(greenhouse=HALL)
        self.newest: LaserScan | None = None
        self.all_clear = LaserSight(Plan.of(HALL), self._newest).all_clear()
        self.confidences = 0.85, 0.85
        """Of the camera, in turn with seconds."""
        self._rng = np.random.default_rng(1)

    def _newest(self, robot: RobotState) -> LaserScan | None:
        return self.newest if robot.robot_id == "AGI" else None

    def step(self, people: list[Place], x: float, speed: float) -> None:
        """A tenth of a second later; the camera sees everybody who is ahead."""
        self.now = round(self.now + TICK_S, 6)
        self.drive("AGI", x, linear=speed)
        ahead = [one for one in people if self.is_in_view(*one, x)]
        sure = self.confidences[int(self.now) % 2]
        self.look("AGI", *(person(*one, probability=sure) for one in ahead))
        discs = [Disc(*one, 0.25) for one in people]
        pose = Pose2D(x, 0.0, 0.0)
        ranges = sweep(pose, MODEL, Scenery.of(HALL), discs, [], self._rng)
        said = scan("AGI", ranges, angle_min=-math.pi)
        said = replace(said, angle_increment=MODEL.angle_increment)
        self.scan("AGI", said)
        self.newest = said

    def steps(
        self, walks: Iterable[Walk], pace: float, speed: float, count: int
    ) -> Iterator[tuple[list[Place], float]]:
        """So many steps: where people are who walk, and how far AGI is."""
        x, walking = -2.0, [(place, [*stops]) for place, stops in walks]
        for _ in range(count):
            x = _drives_on(x, speed, (place for place, _ in walking))
            walking = [
                (_keeps_off(place, goes(place, stops, pace), (x, 0.0)), stops)
                for place, stops in walking
            ]
            people = [place for place, _ in walking]
            self.step(people, x, speed)
            yield people, x

    def has_ring(self, x: float, y: float) -> bool:
        """Whether some ring takes a place in."""
        return any(
            math.dist(ring.place, (x, y)) <= radius
            for one in self.everyone
            for ring, radius in self.people.rings(one, self.rule, at(self.now))
        )

    def is_in_view(self, x: float, y: float, from_x: float) -> bool:
        """Whether AGI's camera sees a place from where AGI stands."""
        profile = self.world.robot("AGI").profile
        camera = Pose2D(from_x, 0.0, 0.0).compose(profile.camera)
        bearing = math.atan2(y - camera.y, x - camera.x) - camera.yaw
        return abs(math.remainder(bearing, math.tau)) <= profile.camera_fov / 2


def goes(place: Place, stops: list[Place], speed: float) -> Place:
    """A tenth of a second of a walk from stop to stop."""
    away = math.dist(place, stops[0])
    way = min(speed * TICK_S, away)
    if way == away:
        return stops.pop(0) if len(stops) > 1 else stops[0]
    return (
        place[0] + (stops[0][0] - place[0]) * way / away,
        place[1] + (stops[0][1] - place[1]) * way / away,
    )


def _keeps_off(place: Place, there: Place, robot: Place) -> Place:
    """Where somebody goes who walks into no robot."""
    away = math.dist(there, robot)
    return there if away > _OFF_M or away > math.dist(place, robot) else place


def _drives_on(x: float, speed: float, people: Iterable[Place]) -> float:
    """Where a robot on y = 0 is a tenth of a second later: it drives into nobody."""
    there = x + speed * TICK_S
    is_free = all(math.dist((there, 0.0), one) > _OFF_M for one in people)
    return there if is_free else x
