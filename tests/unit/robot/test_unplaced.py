"""A robot that knows how fast it is and not where: what it sends, and how it drives."""

import orjson
import pytest

from iveg.domain.geometry import Twist2D
from iveg.domain.observations import (
    DetectionFrame,
    Origin,
    RobotFault,
    SafetyReport,
    Unplaced,
)
from iveg.ngsi import codec, names
from iveg.robot.caps import Cap
from iveg.robot.effects import Report
from iveg.robot.uplink import Uplink
from tests.builders import START, detection, odometry
from tests.unit.robot.rig import AHEAD, REST, Rig, stop

UNREAD = ("farmer", None)


def sent(observation: Unplaced | DetectionFrame) -> tuple[str, bytes]:
    wire: list[tuple[str, bytes]] = []
    uplink = Uplink("AGI", "iveg", "b", lambda topic, raw: wire.append((topic, raw)))
    uplink.send(observation, START)
    return wire[0]


# --- what is sent -------------------------------------------------------------------


def test_odometry_without_a_place_carries_its_speed_and_no_number_for_a_place() -> None:
    topic, payload = sent(Unplaced("", Origin(), "odometry", Twist2D(0.4, 0.1)))

    value = orjson.loads(payload)[names.ODOMETRY]

    assert topic == "/iveg/AGI_odom/attrs"
    assert (value["x"], value["y"], value["yaw"]) == (None, None, None)
    assert (value["linear_velocity"], value["angular_velocity"]) == (0.4, 0.1)
    assert (value["frame_id"], value["seq"]) == ("unplaced", 1)


@pytest.mark.parametrize(
    ("kind", "device"), [("odometry", "AGI_odom"), ("scan", "AGI_lidar2D")]
)
def test_iveg_counts_what_has_no_place_and_places_nothing(
    kind: str, device: str
) -> None:
    unplaced = Unplaced("", Origin(), "scan" if kind == "scan" else "odometry", REST)
    _, payload = sent(unplaced)

    reading = codec.read_measure(device, payload)

    assert reading.observations == ()
    assert [problem.reason for problem in reading.problems] == ["unplaced"]


def test_a_reader_that_does_not_know_unplaced_refuses_the_whole() -> None:
    _, payload = sent(Unplaced("", Origin(), "odometry", REST))
    value = orjson.loads(payload)
    del value[names.ODOMETRY]["frame_id"]

    reading = codec.read_measure("AGI_odom", orjson.dumps(value))

    assert reading.observations == ()


def test_whoever_was_seen_without_a_place_is_unreadable_to_iveg() -> None:
    """An unreadable detection slows the fleet; an empty frame would not."""
    _, payload = sent(DetectionFrame("", Origin(), (detection("farmer", 1.0),), UNREAD))

    (frame,) = codec.read_measure("AGI_yolox_bounding_boxes", payload).observations

    assert isinstance(frame, DetectionFrame)
    assert (len(frame.detections), frame.unread) == (1, UNREAD)


def test_the_single_payload_does_not_call_them_an_empty_look() -> None:
    wire: list[bytes] = []
    uplink = Uplink("AGI", "iveg", "b", lambda _, raw: wire.append(raw), form="single")

    uplink.send(DetectionFrame("", Origin(), (), UNREAD), START)
    uplink.send(odometry(), START)

    found = codec.read_measure("AGI", wire[0]).observations
    assert [one.unread for one in found if isinstance(one, DetectionFrame)] == [UNREAD]


def test_faults_come_back_as_they_were_reported() -> None:
    faults = (RobotFault("no_transform", "map → odom", 2.1), RobotFault("flood", "/tf"))
    report = SafetyReport("AGI", Origin("b", 1), 0.0, "stale", faults=faults)

    (read,) = codec.read_measure("AGI_safety", codec.write_safety(report)).observations

    assert isinstance(read, SafetyReport)
    assert read.faults == faults


def test_a_report_without_faults_has_no_such_key() -> None:
    report = SafetyReport("AGI", Origin("b", 1), 1.0, "clear")

    assert "faults" not in orjson.loads(codec.write_safety(report))[names.SAFETY]


# --- how it drives ------------------------------------------------------------------


def test_a_robot_without_a_place_stands_and_still_measures_how_fast_it_is() -> None:
    rig = Rig().drive_on()
    rig.odometry = False

    rig.perform(rig.machine.odometry(None, Twist2D(0.3, 0.0), rig.now))

    assert rig.twist == REST
    assert rig.machine.cap == Cap(0.0, "stale")
    report = rig.machine.tick(rig.now + 1.0)[-1]
    assert isinstance(report, Report)
    assert report.report.linear == 0.3


def test_a_robot_without_a_place_that_is_stopped_is_seen_to_stand() -> None:
    rig = Rig().drive_on()
    rig.odometry = False
    rig.command(stop("01STOP"))

    rig.perform(rig.machine.odometry(None, Twist2D(0.3, 0.0), rig.now))
    braking = rig.state
    rig.perform(rig.machine.odometry(None, REST, rig.now))

    assert (braking, rig.state) == ("BRAKING", "STANDING")


def test_the_robots_own_software_may_only_ask_for_less() -> None:
    rig = Rig().drive_on()

    rig.machine.limit(Cap(0.5, "stale", "flood"))
    rig.run(0.2)
    halved = rig.twist
    rig.machine.limit(Cap(1.0, "clear"))
    rig.run(3.0)

    assert halved.linear_x <= AHEAD.linear_x / 2
    assert rig.twist == AHEAD
