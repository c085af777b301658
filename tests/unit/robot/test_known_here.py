"""Places that iVeg knows, on the robot: its own laser leaves them out while told so."""

import math
from dataclasses import replace

import numpy as np
import pytest

from iveg.domain.feedback import Feedback
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.known import KnownPlace
from iveg.domain.observations import LaserScan, Origin
from iveg.domain.witness import Outline, Plan
from iveg.ngsi.codec import read_feedback, write_feedback
from iveg.robot.judgement import Limits
from tests.unit.robot.rig import Rig

_ROW = Greenhouse(
    "row", Rectangle(-9.0, -9.0, 9.0, 9.0), rows=(Rectangle(-9.0, 1.0, 9.0, 2.0),)
)
_TIP = (0.3, 0.57)
_LEARNT = KnownPlace(0.3, 0.55, 0.3, 0.5)
_BEAMS = 720


def sees(*places: tuple[float, float]) -> LaserScan:
    """A sweep of a robot at the origin that shows small things at these places."""
    step = math.tau / _BEAMS
    ranges = np.full(_BEAMS, np.inf, np.float32)
    for x, y in places:
        beam = round((math.atan2(y, x) + math.pi) / step)
        ranges[beam - 3 : beam + 4] = math.hypot(x, y)
    here = Pose2D(0.0, 0.0, 0.0)
    return LaserScan("AGI", Origin(), -math.pi, step, 0.1, 30.0, here, ranges)


def told(rig: Rig, *places: KnownPlace, robot_id: str = "AGI") -> None:
    rig.hear(rig.feedback(robot_id=robot_id, known_here=places), robot_id)


def looks(rig: Rig, *places: tuple[float, float], times: int = 8) -> str:
    """Look for some tenths of a second; returns the reason of the limit."""
    for _ in range(times):
        rig.step()
        rig.step()
        rig.perform(rig.machine.scan(sees(*places), rig.now))
    return rig.machine.cap.reason


@pytest.fixture
def rig() -> Rig:
    limits = Limits(outline=Outline(1.0, 0.7), plan=Plan.of(_ROW))
    return Rig(limits=limits).drive_on()


def test_what_stands_still_at_a_known_place_slows_no_robot(rig: Rig) -> None:
    assert looks(rig, _TIP) == "obstacle"
    told(rig, _LEARNT)
    assert looks(rig, times=20) == "clear"
    assert looks(rig, _TIP) == "clear"


def test_what_is_told_to_a_peer_is_not_for_this_robot(rig: Rig) -> None:
    told(rig, _LEARNT, robot_id="AGII")
    assert looks(rig, _TIP) == "obstacle"


def test_a_feedback_without_places_ends_them(rig: Rig) -> None:
    told(rig, _LEARNT)
    told(rig)
    assert looks(rig, _TIP) == "obstacle"


def test_without_fresh_feedback_nothing_is_known(rig: Rig) -> None:
    told(rig, _LEARNT)
    rig.speaks = False
    rig.run(1.3)
    looks(rig, _TIP)
    assert rig.machine._judgement._obstacle_cap(rig.now).reason == "obstacle"


@pytest.mark.parametrize(
    "path",
    [
        [(0.3 + 0.06 * n, 0.57) for n in range(12)],
        [(0.9 - 0.09 * n, 0.57) for n in range(8)],
        [(0.3, 0.57 - 0.02 * n) for n in range(10)],
    ],
    ids=["moves out of it", "comes into it", "reaches into the aisle"],
)
def test_what_moves_slows_as_ever(rig: Rig, path: list[tuple[float, float]]) -> None:
    told(rig, _LEARNT)
    reasons = {looks(rig, one, times=1) for one in path}
    assert "obstacle" in reasons


def test_what_moves_within_the_word_of_an_operator_slows_as_ever(rig: Rig) -> None:
    told(rig, KnownPlace(0.0, 0.1, 0.5))
    rig.pose = Pose2D(-1.5, 0.0, 0.0)
    steps = [(1.05 + 0.1 * n, 0.1) for n in range(9)]
    assert [looks(rig, one, times=1) for one in steps][-1] == "obstacle"


def test_what_is_larger_than_the_place_slows_as_ever(rig: Rig) -> None:
    told(rig, _LEARNT)
    wide = [(0.3 + 0.1 * n, 0.57) for n in range(-1, 5)]
    assert looks(rig, *wide) == "obstacle"


def test_without_a_plan_only_the_word_of_an_operator_counts() -> None:
    limits = Limits(outline=Outline(1.0, 0.7))
    rig = Rig(limits=limits).drive_on()
    told(rig, KnownPlace(0.9, 0.1, 0.3, 0.5))
    assert looks(rig, (0.9, 0.1)) == "obstacle"
    told(rig, KnownPlace(0.9, 0.1, 0.5))
    looks(rig, times=20)
    assert looks(rig, (0.9, 0.1)) == "clear"


def feedback_of(*places: KnownPlace) -> Feedback:
    return Feedback("AGI", Origin("cloud", 1), known_here=places)


def test_places_survive_the_wire() -> None:
    places = _LEARNT, KnownPlace(2.0, -1.0, 0.5)
    assert read_feedback(write_feedback(feedback_of(*places))).known_here == places
    assert b"known_here" not in write_feedback(feedback_of())


@pytest.mark.parametrize(
    "said",
    [
        b'"here"',
        b'[{"x":1}]',
        b'[{"x":1,"y":1,"radius_m":3}]',
        b'[{"x":1e99,"y":1,"radius_m":0.3}]',
        b"[" + b",".join([b'{"x":1,"y":1,"radius_m":0.3}'] * 33) + b"]",
    ],
)
def test_places_that_cannot_be_read_are_none_and_cost_nothing_else(
    said: bytes,
) -> None:
    plain = write_feedback(feedback_of())
    read = read_feedback(plain[:-1] + b',"known_here":' + said + b"}")
    assert read == replace(feedback_of(), known_here=())
