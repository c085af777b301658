"""A laser makes no robot faster, and none later slow (docs/safety.md, "The laser")."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.laser import Plan
from iveg.domain.observations import LaserScan, Origin
from iveg.robot.judgement import Limits
from tests.unit.robot.rig import AHEAD, Rig, person

BEAMS = 24
PLANS = (None, Plan.from_greenhouse(Greenhouse("g", Rectangle(-9.0, -9.0, 9.0, 9.0))))
_RANGE = st.sampled_from((0.0, 0.05, 0.6, 1.4, 2.2, 2.9, 8.0, math.inf, math.nan, 1e30))
_STEP = st.tuples(
    st.sampled_from((-2.5, 0.0, 0.3)),
    st.booleans(),
    st.lists(_RANGE, min_size=BEAMS, max_size=BEAMS) | st.none(),
)


@given(st.sampled_from(PLANS), st.lists(_STEP, max_size=12))
def test_no_scan_makes_a_robot_faster(
    plan: Plan | None, run: list[tuple[float, bool, list[float] | None]]
) -> None:
    limits = Limits(RobotProfile(length=1.0, width=0.7), plan=plan)
    blind, sighted = Rig().drive_on(), Rig(limits=limits).drive_on()
    for x, somebody, ranges in run:
        for rig in (blind, sighted):
            rig.pose = Pose2D(x, 0.0, 0.2)
            rig.alerts = (person(3.0),) if somebody else ()
        if ranges is not None:
            sighted.perform(sighted.machine.scan(_scan(ranges), sighted.now))
        for _ in range(4):
            blind.step()
            sighted.step()
            assert sighted.machine.cap.factor <= blind.machine.cap.factor
            assert sighted.twist.linear_x <= max(blind.twist.linear_x, 0.0)
    assert blind.wished == sighted.wished == AHEAD


def _scan(ranges: list[float]) -> LaserScan:
    step, here = math.tau / BEAMS, Pose2D(0.0, 0.0, 0.0)
    told = np.array(ranges, np.float32)
    return LaserScan("AGI", Origin(), -math.pi, step, 0.1, 30.0, here, told)
