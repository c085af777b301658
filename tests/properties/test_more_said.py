"""An observer, a box or a word more makes no robot faster and ends nobody's zone."""

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.geometry import Box3D
from iveg.domain.observations import Detection
from tests.builders import detection
from tests.unit.vital.desk import Desk

ROBOTS = {"AGI": 0.0, "AGII": 5.0}
OBSERVER = "AG3"
"""It stands far away: its own ring is none of theirs."""

metres = st.sampled_from([-3.0, -0.5, 0.0, 1.5, 2.0, 3.2, 6.0, 40.0])
sides = st.sampled_from([0.0, 0.4, 0.7, 1.3, 2.2, 11.0])
boxes = st.builds(
    lambda x, y, along, across, up: Box3D(
        x - along / 2, x + along / 2, y - across / 2, y + across / 2, 0.0, up
    ),
    metres,
    metres,
    sides,
    sides,
    sides,
)
more = st.builds(
    Detection,
    st.sampled_from(
        ["farmer", "0: persona", "0", "", "tractor", "tomato", "husky", "class_2", "ñ"]
    ),
    st.sampled_from([0.3, 0.6, 0.8, 1.0]),
    boxes,
    st.sampled_from(["map", "base_link", "rear_camera_optical_frame", "odom", None]),
)
people = st.lists(
    st.tuples(
        st.floats(-2.0, 8.0),
        st.floats(-3.0, 3.0),
        st.sampled_from([-1.2, 0.0, 0.4]),
        st.sampled_from(["farmer", "husky"]),
    ),
    max_size=3,
)
"""Where each is at first, how fast they go along, and what detectors call them."""
steps = st.lists(
    st.tuples(
        st.sampled_from([0.1, 0.3, 0.9]),
        st.lists(st.booleans(), min_size=6, max_size=6),
        st.lists(more, max_size=3),
    ),
    min_size=2,
    max_size=15,
)
"""How long it takes, whom AGI and AGII miss, and what is said more."""


def zones(desk: Desk) -> set[tuple[str, float, float, float, float]]:
    """Observer, place, moment and width of each zone."""
    evaluator, now = desk.evaluator, desk.clock()
    return {
        (one.observer, one.x, one.y, one.at.mono, round(radius, 6))
        for somebody in evaluator.people.known.values()
        for one, radius in evaluator.people.zone_radii(somebody, evaluator.rule, now)
        if one.observer in ROBOTS
    }


@given(
    people,
    st.sampled_from([-0.4, 0.0, 0.4]),
    st.sampled_from([*ROBOTS, OBSERVER]),
    steps,
)
def test_what_is_said_more_raises_no_factor_and_ends_no_zone_of_others(
    around: list[tuple[float, float, float, str]],
    speed: float,
    by: str,
    run: list[tuple[float, list[bool], list[Detection]]],
) -> None:
    less, also = Desk(tuple(ROBOTS)), Desk((*ROBOTS, OBSERVER))
    for pause, misses, extra in run:
        for desk in (less, also):
            desk.clock.now += pause
        now = less.clock.now
        shown = [detection(what, x + v * now, y) for x, y, v, what in around]
        for desk in (less, also):
            for number, (robot_id, x) in enumerate(ROBOTS.items()):
                # Whose next box it is that is said more, nobody can tell.
                missed = misses[3 * number :] if robot_id != by else [False] * 3
                seen = [
                    one for one, gone in zip(shown, missed, strict=False) if not gone
                ]
                desk.drive(robot_id, x + speed * now, linear=speed)
                is_more = desk is also and robot_id == by
                desk.look(robot_id, *seen, *(extra if is_more else ()))
        also.drive(OBSERVER, 60.0, linear=0.0)
        also.look(OBSERVER, *(extra if by == OBSERVER else ()))

        assert zones(less) <= zones(also)
        for robot_id in ROBOTS:
            told = also.evaluator.speed_limits[robot_id].speed_factor
            assert told <= less.evaluator.speed_limits[robot_id].speed_factor
