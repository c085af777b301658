"""No ring ends while the person may be where nobody has one (docs/safety.md, "Age")."""

import math
from dataclasses import replace

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse, StructuralPost
from iveg.domain.limits import LIMITS
from iveg.domain.observations import LaserScan
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.laser_sight import LaserSight
from iveg.domain.tracking.sight import AllClear
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
_TICK_S = 0.1
_PLACES = st.tuples(st.floats(-7.0, 7.0), st.floats(-5.0, 5.0))
_WALKS = st.tuples(_PLACES, st.lists(_PLACES, min_size=1, max_size=4))


class Hall(Scene):
    """AGI stands or drives in the middle; its laser and its camera tell the truth."""

    def __init__(self) -> None:
        super().__init__(greenhouse=HALL)
        self.newest: LaserScan | None = None
        swept = LaserSight(Plan.of(HALL), self._newest).swept
        self.all_clear = AllClear(swept)
        self.confidences = 0.85, 0.85
        """Of the camera, in turn with seconds."""
        self._rng = np.random.default_rng(1)

    def _newest(self, robot: RobotState) -> LaserScan | None:
        return self.newest if robot.robot_id == "AGI" else None

    def step(self, people: list[tuple[float, float]], x: float, speed: float) -> None:
        """A tenth of a second later; the camera sees everybody who is ahead."""
        self.now = round(self.now + _TICK_S, 6)
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

    def is_in_view(self, x: float, y: float, from_x: float) -> bool:
        """Whether AGI's camera sees a place from where AGI stands."""
        profile = self.world.robot("AGI").profile
        camera = Pose2D(from_x, 0.0, 0.0).compose(profile.camera)
        bearing = math.atan2(y - camera.y, x - camera.x) - camera.yaw
        return abs(math.remainder(bearing, math.tau)) <= profile.camera_fov / 2


def _goes(
    place: tuple[float, float], stops: list[tuple[float, float]], speed: float
) -> tuple[float, float]:
    """A tenth of a second of a walk from stop to stop."""
    away = math.dist(place, stops[0])
    way = min(speed * _TICK_S, away)
    if way == away:
        return stops.pop(0) if len(stops) > 1 else stops[0]
    return (
        place[0] + (stops[0][0] - place[0]) * way / away,
        place[1] + (stops[0][1] - place[1]) * way / away,
    )


@given(
    st.lists(_WALKS, min_size=1, max_size=2),
    st.floats(0.4, LIMITS.walking_m_s),
    st.sampled_from((0.0, 0.4)),
    st.sampled_from(((0.85, 0.85), (0.85, 0.6), (0.6, 0.85))),
)
# Who was never seen loses the ring of somebody else, which covered them by chance.
@example(
    [((0.0, 0.0), [(0.0, 2.0)]), ((0.0, 3.0), [(0.0, 4.0)])], 1.0, 0.4, (0.85,) * 2
)
def test_no_all_clear_leaves_somebody_who_walks_without_a_ring_and_nobody_is_made_up(
    walks: list[tuple[tuple[float, float], list[tuple[float, float]]]],
    pace: float,
    speed: float,
    confidences: tuple[float, float],
) -> None:
    hall, x = Hall(), -2.0
    hall.confidences = confidences
    walks = [(place, [*stops]) for place, stops in walks]
    seen = set[int]()
    for _ in range(60):
        x += speed * _TICK_S
        walks = [(_goes(place, stops, pace), stops) for place, stops in walks]
        # Nobody walks into a robot.
        there = {n: p for n, (p, _) in enumerate(walks) if math.dist(p, (x, 0.0)) > 0.8}
        people = [*there.values()]
        hall.step(people, x, speed)
        followed = _followed(hall)
        for spot in followed:
            assert min(math.dist(spot, one) for one in people) < 0.5
        seen |= {
            number
            for number, one in there.items()
            if hall.is_in_view(*one, x)
            or any(math.dist(one, spot) < 0.5 for spot in followed)
        }
        had = [
            there[one] for one in seen & there.keys() if _has_ring(hall, *there[one])
        ]
        hall.sweep()
        assert all(_has_ring(hall, *one) for one in had)


def test_whom_a_laser_sees_is_remembered_as_long_as_the_one_whom_a_camera_saw() -> None:
    hall, place, stops = Hall(), (0.0, 0.0), [(0.0, 0.0), (-2.0, 1.6)]
    ended, seen = None, 0.0
    for _ in range(60):
        place = _goes(place, stops, 0.6)
        hall.step([place], -2.0, 0.0)
        seen = hall.now if hall.is_in_view(*place, -2.0) else seen
        if hall.sweep() and ended is None:
            ended = hall.now
    rings = [one for somebody in hall.everyone for one in somebody.sightings]
    assert ended is not None
    assert all(one.laser for one in rings)
    assert max(one.at.mono + one.lasts_s for one in rings) >= at(seen).mono + 10.0


def _followed(hall: Hall) -> list[tuple[float, float]]:
    """Where the laser has those who walk, just now."""
    seen = (look for one in hall.everyone for look in one.sightings if look.laser)
    return [(one.x, one.y) for one in seen if one.age_s(at(hall.now)) < _TICK_S / 2]


def _has_ring(hall: Hall, x: float, y: float) -> bool:
    return any(
        math.dist((ring.x, ring.y), (x, y)) <= radius
        for one in hall.everyone
        for ring, radius in hall.people.rings(one, hall.rule, at(hall.now))
    )
