"""A ring that goes with somebody leaves nobody (docs/safety.md, "The laser")."""

import math

from hypothesis import example, given
from hypothesis import strategies as st

from iveg.domain.limits import LIMITS
from iveg.domain.tracking.person import Sighting
from tests.builders import at
from tests.properties.hall import WALKS, Hall, Place, Walk

_FROM, _STANDS = (0.4, 1.0), (-2.2, 1.4)


@given(
    st.lists(WALKS, min_size=1, max_size=3),
    st.floats(0.4, LIMITS.walking_m_s),
    st.sampled_from((0.0, 0.4)),
    st.sampled_from(((0.85, 0.85), (0.85, 0.6), (0.6, 0.85))),
)
# Behind somebody who stands there, where the laser does not see them, and on.
@example(
    [(_FROM, [(-1.6, 1.95), (-3.2, 1.95), (-7.5, 1.95)]), (_STANDS, [_STANDS])],
    1.6,
    0.0,
    (0.85,) * 2,
)
def test_whom_a_ring_would_take_in_it_takes_in_where_it_moved(
    walks: list[Walk],
    pace: float,
    speed: float,
    confidences: tuple[float, float],
) -> None:
    """Also who walks behind somebody else, where the laser does not see them."""
    hall = Hall()
    hall.confidences = confidences
    places = dict[float, list[Place]]()
    for people, _ in hall.steps(walks, pace, speed, 80):
        now = at(hall.now)
        places[now.mono] = people
        hall.sweep()
        for somebody in hall.everyone:
            for ring, radius in hall.people.rings(somebody, hall.rule, now):
                if ring.followed is not None:
                    there = places[ring.at.mono]
                    who = min(range(len(there)), key=lambda n: _apart(ring, there[n]))
                    is_out = math.dist(ring.place, people[who]) > radius
                    would_stay = hall.rule.radius_at(ring.age_s(now))
                    assert not is_out or _apart(ring, people[who]) > would_stay


def _apart(look: Sighting, place: Place) -> float:
    return math.dist((look.x, look.y), place)
