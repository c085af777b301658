import pytest

from iveg.domain.observations import Instant
from iveg.domain.robot_state import Doubts


def at(mono: float) -> Instant:
    return Instant(mono, 1e9 + mono)


def contradicted(*moments: float) -> Doubts:
    doubts = Doubts()
    for moment in moments:
        doubts.contradicted("jump", at(moment))
    return doubts


@pytest.mark.parametrize(("later", "doubted"), [(2.5, True), (2.7, False)])
def test_a_doubt_ends_after_a_second_of_consistency(
    later: float, *, doubted: bool
) -> None:
    assert bool(contradicted(1.0, 1.6).active(at(later))) is doubted


def test_contradictions_far_apart_are_two_beginnings() -> None:
    assert contradicted(1.0, 2.1, 3.2).active(at(3.2)) == ()
