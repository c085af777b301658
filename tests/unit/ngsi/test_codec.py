"""What the contract says is read; what iVeg writes is as the contract says."""

import math

import orjson
import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import Feedback, FeedbackAlert, SpeedLimit
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import (
    CommandAnswer,
    CommandStatus,
    DetectionFrame,
    LaserScan,
    Odometry,
    Origin,
)
from iveg.domain.parameters import ByClass, sent_to_robots
from iveg.ngsi import codec, names
from tests.builders import (
    START,
    at,
    odometry,
    origin,
    safety_report,
)

LISTING_1 = b"""{
  "id": "AGX", "type": "Robot",
  "base_pose_ground_truth": {"type": "object", "value": {
    "x": 14.134062767, "y": 11.46727562, "yaw": -0.386157338,
    "linear_velocity": 0.999, "angular_velocity": 0.34}},
  "bounding_boxes": {"type": "object", "value": {
    "class_id": "farmer", "probability": 0.945, "position": {
      "xmin": 0.4506256580352783, "ymin": -0.3164764642715454,
      "xmax": 0.7936256527900696, "ymax": 0.11368180811405182,
      "zmin": -0.25958430767059326, "zmax": 0.10506562888622284}}},
  "lidar_points": {"type": "array", "value": [5.3208699226379395, 5.330774307250977]},
  "metadata": {"TimeInstant": {"type": "DateTime", "value": "2026-04-26T10:21:14.660Z"}}
}"""


def entity(**attributes: object) -> list[object]:
    reading = codec.read_entity({"id": "AGI", "type": "Robot", **attributes})
    assert reading.problems == ()
    return list(reading.observations)


# --- Orion ------------------------------------------------------------------------


def test_the_papers_listing_1_is_accepted_as_it_stands() -> None:
    body = b'{"subscriptionId": "s", "data": [' + LISTING_1 + b"]}"

    _, reading = codec.read_notification(body)

    pose, sweep, frame = reading.observations
    assert reading.problems == ()
    assert isinstance(pose, Odometry)
    assert pose.pose == Pose2D(14.134062767, 11.46727562, -0.386157338)
    assert isinstance(sweep, LaserScan)
    assert isinstance(frame, DetectionFrame)
    assert frame.detections[0].class_id == "farmer"
    assert frame.detections[0].frame_id is None


def test_the_agents_opinion_and_the_robots_answer_are_told_apart() -> None:
    status, answer = entity(
        cmd_status="OK", cmd_info={"id": "01A", "r": "LATCHED", "boot": "b", "seq": 1}
    )

    assert status == CommandStatus("AGI", "OK")
    assert answer == CommandAnswer("AGI", Origin("b", 1), "01A", "LATCHED")


# --- Algorithm 1 ------------------------------------------------------------------


def test_algorithm_1s_single_payload_is_accepted() -> None:
    payload = orjson.dumps(
        {
            "class": "farmer",
            "conf": 0.91,
            "position_3D": {"x": 1.0, "y": 2.0, "z": 0.9},
            "pose": {
                "x": 3.0,
                "y": 4.0,
                "yaw": 0.5,
                "linear_velocity": 0.4,
                "angular_velocity": 0.1,
            },
            "laser_scan": [1.0, None, 3.0, 4.0],
            "timestamp": "2026-11-20T10:00:00.000Z",
        }
    )

    reading = codec.read_measure("AGI", payload)

    pose, sweep, frame = reading.observations
    assert reading.problems == ()
    assert isinstance(pose, Odometry)
    assert pose.twist == Twist2D(0.4, 0.1)
    assert pose.origin.stamp == "2026-11-20T10:00:00.000Z"
    assert isinstance(sweep, LaserScan)
    assert sweep.angle_min == -math.pi
    assert sweep.angle_increment == pytest.approx(math.pi / 2)
    assert isinstance(frame, DetectionFrame)
    (seen,) = frame.detections
    assert seen.box.centre == pytest.approx((1.0, 2.0, 0.9))
    assert (seen.frame_id, seen.probability) == ("map", 0.91)


# --- stamps -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("2023-11-14T22:13:20.000Z", START.wall),
        ("2023-11-15T00:13:20+02:00", START.wall),
        ("2023-11-14T22:13:20", START.wall),
        ("garbage", None),
        ("1700000000", None),
    ],
)
def test_stamps_are_iso_8601_in_utc_or_nothing(
    text: str, seconds: float | None
) -> None:
    assert codec.parse_stamp(text) == seconds


# --- commands, feedback -----------------------------------------------------------


def test_commands_are_written_as_the_contract_says() -> None:
    stop = codec.write_command(codec.StopOrder("01A", "opaque"))

    assert stop == b'{"cmd":{"stop":{"id":"01A","by":"opaque"}}}'
    assert codec.write_order(codec.ReleaseOrder("c", "01T", ("01A", "boot-1"))) == (
        "cmd",
        {"release": {"ids": ["01A", "boot-1"], "ch": "c", "attempt": "01T"}},
    )
    assert codec.write_order(codec.ResumeOrder("c", "01T"))[1] == {
        "resume": {"ch": "c", "attempt": "01T"}
    }
    assert codec.write_desired("stopped", ["01A"]) == (
        b'{"desired":"stopped","ids":["01A"]}'
    )


def test_feedback_is_written_as_the_contract_says() -> None:
    alert = FeedbackAlert(
        "d-1", "t", "person", "farmer", 0.94, (1.0, 2.0, 0.9), 2.0, "AGI"
    )
    feedback = Feedback(
        "AGI",
        Origin("b", 412, "t"),
        alert,
        (alert,),
        Pose2D(1.0, 2.0, 0.1),
        Twist2D(0.5, 0.0),
        "t",
        {"AGI": SpeedLimit(1.0), "AGII": SpeedLimit(0.5, "person", None, 1.43, "d-1")},
        {"AGII": 8731},
    )

    written = orjson.loads(codec.write_feedback(feedback))

    limited = {"speed_factor": 0.5, "reason": "person", "distance_m": 1.43}
    who = {"class": "person", "class_id": "farmer", "conf": 0.94, "observer": "AGI"}
    where = {"position": {"x": 1.0, "y": 2.0, "z": 0.9}, "radius_m": 2.0}
    pose = {"x": 1.0, "y": 2.0, "yaw": 0.1}
    twist = {"linear_velocity": 0.5, "angular_velocity": 0.0}
    told = {"decision_id": "d-1", "stamp": "t"} | who | where
    assert written == {
        "boot": "b",
        "seq": 412,
        "stamp": "t",
        "robot_id": "AGI",
        "alert": told,
        "alerts": [told],
        "robot_pose": {**pose, **twist, "stamp": "t"},
        "speed_limits": {"AGII": limited | {"decision_id": "d-1"}},
        "clear": ["AGI"],
        "seen": {"AGII": 8731},
    }


def test_a_speed_limit_goes_before_a_clear_of_the_same_robot() -> None:
    limits = {"AGI": {"speed_factor": 0.5, "reason": "person"}}
    said = {"robot_id": "AGI", "speed_limits": limits, "clear": ["AGI"]}

    feedback = codec.read_feedback(orjson.dumps(said))

    assert feedback.speed_limits == {"AGI": SpeedLimit(0.5, "person")}


@pytest.mark.parametrize(("lag", "told"), [(0.04, 0.0), (12.34, 12.3), (500.0, 60.0)])
def test_a_backlog_is_told_in_seconds_up_to_a_minute(lag: float, told: float) -> None:
    payload = codec.write_feedback(Feedback("AGI", Origin(), backlog_s=lag))

    assert orjson.loads(payload)["backlog"] == {"fiware_s": told}
    assert codec.read_feedback(payload).backlog_s == told


@pytest.mark.parametrize(
    ("told", "read"),
    [
        ({"fiware_s": 7}, 7.0),
        ({"fiware_s": 1e9}, 60.0),
        ({"fiware_s": -1}, None),
        ({"fiware_s": True}, None),
        ({}, None),
    ],
)
def test_a_backlog_that_cannot_be_read_costs_no_speed_limit(
    told: object, read: float | None
) -> None:
    limits = {"AGI": {"speed_factor": 0.5}}
    said = {"robot_id": "AGI", "speed_limits": limits, "backlog": told}

    feedback = codec.read_feedback(orjson.dumps(said))

    assert feedback.backlog_s == read
    assert feedback.speed_limits["AGI"].speed_factor == 0.5


def test_every_measure_carries_its_stamp_at_the_top_level_too() -> None:
    written = orjson.loads(codec.write_measure(odometry(origin=origin())))

    assert written["TimeInstant"] == codec.format_stamp(at(0).wall)


@pytest.mark.parametrize(
    ("part", "told"),
    [
        ("obstacle", {"x": 1e9, "y": 0.0, "width_m": 0.4, "moved": True}),
        ("obstacle", {"x": 0.0, "y": 0.0, "width_m": -0.1, "moved": True}),
        ("obstacle", {"x": 0.0, "y": 0.0, "moved": True}),
        ("obstacle", "somebody"),
        ("peer_scans", {"every": 1}),
    ],
)
def test_what_is_told_beside_a_report_and_cannot_be_read_costs_no_report(
    part: str, told: object
) -> None:
    said = orjson.loads(codec.write_measure(safety_report()))
    said["safety_state"][part] = told
    reading = codec.read_measure("AGI_safety", orjson.dumps(said))

    assert reading.problems == ()
    assert reading.observations == (safety_report(),)


# --- names ------------------------------------------------------------------------


def test_devices_are_their_robots_and_no_attribute_holds_what_orion_forbids() -> None:
    for device in names.ROBOT_DEVICES:
        assert names.robot_of_device("AGI" + device.suffix) == "AGI"
        for name, _ in device.attributes:
            assert not set(name) & set("<>\"'=;()")


@pytest.mark.parametrize("frame", ["map", "odom", "AGII/laser", "/world"])
def test_a_scan_in_no_frame_of_its_robot_is_refused_by_name(frame: str) -> None:
    body = b'{"lidar_points": [1.0], "lidar_header": {"angle_min": 0, '
    body += b'"angle_increment": 0.1, "range_max": 9, "frame_id": "%b"}}'

    read = codec.read_measure("AGI_lidar2D", body % frame.encode())

    assert read.observations == ()
    assert [one.reason for one in read.problems] == ["unknown_frame"]


def test_robots_read_the_radii_of_the_rule_in_the_feedback() -> None:
    rule = DetectionRule(radius_m=ByClass(2.0, {"robot": 3.0}))
    told = Feedback("AGI", Origin("b", 1), rule=sent_to_robots(rule))

    payload = codec.write_feedback(told)

    assert orjson.loads(payload)["rule"] == {"radius_m": {"person": 2.0, "robot": 3.0}}
    assert codec.read_feedback(payload).rule == told.rule


@pytest.mark.parametrize(
    "rule",
    [None, 3, [], {"radius_m": 3}, {"radius_m": {"robot": "3", "person": True}},
     {"radius_m": {"robot": 0.4, "person": 1e9}}, {"radius_m": {"crate": 3}}],
    ids=str,
)  # fmt: skip
def test_radii_that_cannot_be_read_are_left_out_and_the_feedback_counts(
    rule: object,
) -> None:
    payload = orjson.dumps({"boot": "b", "seq": 1, "robot_id": "AGI", "rule": rule})

    assert codec.read_feedback(payload).rule == {}
