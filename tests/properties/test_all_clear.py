"""No ring ends while the person may be where nobody has one (docs/safety.md, "Age")."""

import math

from hypothesis import example, given
from hypothesis import strategies as st

from iveg.domain.limits import LIMITS
from tests.builders import at
from tests.properties.hall import TICK_S, WALKS, Hall, Walk, goes


@given(
    st.lists(WALKS, min_size=1, max_size=2),
    st.floats(0.4, LIMITS.walking_m_s),
    st.sampled_from((0.0, 0.4)),
    st.sampled_from(((0.85, 0.85), (0.85, 0.6), (0.6, 0.85))),
)
# Who walks on for as long as their ring is six metres wide.
@example([((6.0, 5.0), [(0.0, 4.0)])], 1.0, 0.0, (0.85,) * 2)
# Who was never seen loses the ring of somebody else, which covered them by chance.
@example(
    [((0.0, 0.0), [(0.0, 2.0)]), ((0.0, 3.0), [(0.0, 4.0)])], 1.0, 0.4, (0.85,) * 2
)
def test_no_all_clear_leaves_somebody_who_walks_without_a_ring_and_nobody_is_made_up(
    walks: list[Walk],
    pace: float,
    speed: float,
    confidences: tuple[float, float],
) -> None:
    hall = Hall()
    hall.confidences = confidences
    seen = set[int]()
    for people, x in hall.steps(walks, pace, speed, 60):
        followed = _followed(hall)
        for spot in followed:
            assert min(math.dist(spot, one) for one in people) < 0.5
        seen |= {
            number
            for number, one in enumerate(people)
            if hall.is_in_view(*one, x)
            or any(math.dist(one, spot) < 0.5 for spot in followed)
        }
        had = [people[one] for one in seen if hall.has_ring(*people[one])]
        hall.sweep()
        assert all(hall.has_ring(*one) for one in had)


def test_whom_a_laser_sees_is_remembered_as_long_as_the_one_whom_a_camera_saw() -> None:
    hall, place, stops = Hall(), (0.0, 0.0), [(0.0, 0.0), (-2.0, 1.6)]
    ended, seen = None, 0.0
    for _ in range(60):
        place = goes(place, stops, 0.6)
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
    return [(one.x, one.y) for one in seen if one.age_s(at(hall.now)) < TICK_S / 2]
