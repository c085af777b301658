"""Boxes that no person has, and boxes that are wide, from the wire to limits."""

from dataclasses import replace

import pytest

from iveg.domain.geometry import Box3D
from iveg.domain.observations import Detection, Received
from iveg.domain.transports import FIWARE
from iveg.ngsi import codec
from tests.builders import detection, detection_frame, odometry, origin
from tests.unit.vital.desk import Desk, conditions_of
from tests.unit.vital.test_frames import factors, parked

UNREAD = "alert.unreadable_detection"


def sides(x: float, along: float, across: float, up: float) -> Detection:
    half = across / 2
    box = Box3D(x - along / 2, x + along / 2, -half, half, 0.0, up)
    return Detection("person", 0.9, box, "map")


def send(desk: Desk, seen: Detection) -> None:
    """A frame of AGI, as it is sent and read."""
    look = detection_frame("AGI", seen, origin=desk.next_origin())
    sent = codec.write_measure(look)
    (frame,) = codec.read_measure("AGI_yolox_bounding_boxes", sent).observations
    desk.hear(frame)


@pytest.mark.parametrize(
    "seen",
    [
        replace(detection(), box=Box3D(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        sides(4.0, 500.0, 0.5, 1.8),
    ],
    ids=["six zeros", "as long as a hall"],
)
async def test_a_box_without_a_place_is_nobody_and_its_frame_is_not_whole(
    seen: Detection,
) -> None:
    desk = parked()

    send(desk, seen)
    await desk.wait(0.1)

    assert factors(desk) == [0.5, 0.5]
    assert desk.evaluator.people.known == {}
    assert UNREAD in conditions_of(desk)


@pytest.mark.parametrize(
    "seen",
    [
        sides(4.0, 0.0, 0.5, 1.8),
        sides(4.0, 0.5, 0.0, 1.8),
        sides(4.0, 1.3, 0.5, 1.8),
        sides(4.0, 0.5, 0.5, 3.1),
    ],
    ids=["flat", "thin", "wide", "high"],
)
def test_a_box_that_no_person_has_protects_and_its_frame_is_not_whole(
    seen: Detection,
) -> None:
    desk = parked()

    send(desk, seen)

    assert factors(desk) == [0.5, 0.5]
    assert len(desk.evaluator.people.known) == 1


def test_a_ring_is_as_much_wider_as_its_box_is_longer_than_a_person() -> None:
    desk = parked("AGI", "AGII")

    # Its near side is a metre from AGI; AGII sees it.
    desk.look("AGII", sides(2.1, 2.2, 0.5, 1.8))

    limit = desk.evaluator.speed_limits["AGI"]
    assert (limit.reason, limit.speed_factor) == ("person", 0.5)
    (alert,) = desk.fleet.told[-1].alerts
    assert alert.radius_m == pytest.approx(2.0 + 1.1 - 0.3)


def test_odometry_in_a_frame_that_the_fleet_file_does_not_name_is_no_pose() -> None:
    desk = Desk(("AGI",))
    in_odom = replace(odometry(origin=origin(seq=1)), frame_id="odom")

    desk.ingest.enqueue(Received(in_odom, desk.clock(), FIWARE.id))

    assert list(desk.ingest.drain()) == []
    assert desk.ingest.counters["rejected.unknown_frame"] == 1
