"""Whatever one robot says, nobody drives faster for it than without that robot.

A farmer stands beside AGI in full view of AGII.  Of two fleets that are alike one has a
third robot, which lies in every number that it sends.
"""

import asyncio
import math
from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st

from iveg.domain.feedback import FULL_SPEED
from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    FeedbackRef,
    Hold,
    Observation,
    Odometry,
    Origin,
    ReportedObstacle,
    SafetyReport,
)
from tests.builders import detection, detection_frame, odometry, origin
from tests.unit.vital.desk import Desk, settle

STEP_S = 0.1
PLACES = {"AGI": 0.0, "AGII": 5.0}
FARMER = detection("farmer", 1.5)

metres = st.sampled_from([0.0, 1.5, 3.0, 60.0, -250.0, 1e6])
speeds = st.sampled_from([0.0, 0.5, -3.0, 100.0])
origins = st.builds(
    Origin,
    st.sampled_from([None, "a", "b", "c", "d"]),
    st.one_of(st.none(), st.integers(0, 50), st.just(2**53)),
    mono=st.sampled_from([None, 0.0, 5.0, 1e9]),
    acknowledgements=st.booleans(),
    heard=st.one_of(
        st.none(),
        st.builds(
            FeedbackRef, st.just("iveg-boot"), st.sampled_from([0, 1, 5, 40, 10**9])
        ),
    ),
)
boxes = st.builds(
    lambda x, y: Box3D(x - 0.2, x + 0.2, y - 0.2, y + 0.2, 0.0, 1.8), metres, metres
)
detections = st.builds(
    Detection,
    st.sampled_from(["farmer", "AGI", "husky", "melon"]),
    st.sampled_from([0.0, 0.6, 0.8, 1.0]),
    boxes,
    st.sampled_from(["map", "base_link"]),
)
holds = st.builds(
    Hold,
    st.sampled_from(["01A", "01B", "01C"]),
    st.sampled_from(["iveg", "boot", "hw"]),
    st.sampled_from(["remote", "local"]),
)
lies = st.one_of(
    st.builds(
        Odometry,
        st.just("R0"),
        origins,
        st.builds(Pose2D, metres, metres, st.sampled_from([0.0, math.pi, 1e4])),
        st.builds(Twist2D, speeds, speeds),
    ),
    st.builds(
        DetectionFrame,
        st.just("R0"),
        origins,
        st.lists(detections, max_size=4).map(tuple),
        st.sampled_from([(), (None,)]),
    ),
    st.builds(
        SafetyReport,
        st.just("R0"),
        origins,
        st.sampled_from([0.0, 0.5, 0.7, 1.0]),
        st.sampled_from(["clear", "hold", "person"]),
        holds=st.lists(holds, max_size=3).map(tuple),
        released=st.lists(st.sampled_from(["01A", "01B"]), max_size=2).map(tuple),
        linear=speeds,
        angular=speeds,
        obstacle=st.none()
        | st.builds(ReportedObstacle, metres, metres, st.just(0.4), st.booleans()),
    ),
)


def honest(desk: Desk) -> None:
    """AGI and AGII say where they are and what they see."""
    for robot_id, x in PLACES.items():
        seen = (FARMER,) if robot_id == "AGII" else ()
        desk.hear(odometry(robot_id, x, linear=0.0, origin=desk.next_origin()))
        desk.hear(detection_frame(robot_id, *seen, origin=desk.next_origin()))


def pass_time(desk: Desk) -> dict[str, float]:
    """A step later: the factor that each honest robot is told."""
    desk.clock.now = round(desk.clock.now + STEP_S, 6)
    desk.loop.step([], desk.clock())
    told = desk.fleet.told[-1].speed_limits
    return {robot_id: told[robot_id].speed_factor for robot_id in PLACES}


async def play(script: list[list[Observation]]) -> None:
    """Both fleets live through it, the second one with the liar."""
    without, beside = Desk(tuple(PLACES)), Desk((*PLACES, "R0"))
    for said in script:
        for desk in (without, beside):
            honest(desk)
        for lie in said:
            beside.hear(lie)
        alone, together = pass_time(without), pass_time(beside)
        for robot_id, factor in together.items():
            assert factor <= alone[robot_id]
    await settle()
    await beside.commander.close()


@settings(max_examples=40, deadline=None)
@given(st.lists(st.lists(lies, max_size=4), min_size=5, max_size=30))
def test_f65_lies_of_one_robot_make_no_other_faster_and_end_nothing(
    script: list[list[Observation]],
) -> None:
    asyncio.run(play(script))


def test_a_third_robot_that_is_honest_slows_nobody_far_away() -> None:
    """Else the above would hold of a program that slows everybody for ever."""
    desk = Desk((*PLACES, "R0"))
    for _ in range(20):
        honest(desk)
        said = odometry("R0", 60.0, origin=desk.next_origin())
        desk.hear(replace(said, twist=Twist2D(0.0, 0.0)))
        desk.hear(detection_frame("R0", origin=origin(desk.next_origin().seq or 0)))
        told = pass_time(desk)

    assert told["AGII"] == FULL_SPEED
