"""What must not pass the door: refused or cleaned, and its neighbours unharmed."""

import time

import orjson
import pytest

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import (
    DetectionFrame,
    Navigation,
    Odometry,
    RefusedFrame,
    SafetyReport,
)
from iveg.ngsi import codec
from tests.builders import notification, pose_value

BOX = {
    "class_id": "farmer",
    "probability": 0.9,
    "position": dict.fromkeys(("xmin", "xmax", "ymin", "ymax", "zmin", "zmax"), 1.0),
    "frame_id": "map",
}
NUMBERS = ["NaN", "Infinity", "-Infinity", "1e999", "-1e999"]


def odometry_payload(x: str) -> bytes:
    value = f'{{"x": {x}, "y": 0.0, "yaw": 0.0}}'
    return f'{{"base_pose_ground_truth": {value}}}'.encode()


def boxes(*raw: object) -> DetectionFrame:
    payload = orjson.dumps({"bounding_boxes": list(raw)})
    (frame,) = codec.read_measure("AGI_yolox_bounding_boxes", payload).observations
    assert isinstance(frame, DetectionFrame)
    return frame


# --- numbers (F27) ----------------------------------------------------------------


@pytest.mark.parametrize(
    "text", [*NUMBERS, '"nan"', '"1.0"', "true", "null", "[1]", "{}", "1e7"]
)
def test_f27_what_is_no_number_in_range_is_refused_and_not_made_one(text: str) -> None:
    reading = codec.read_measure("AGI_odom", odometry_payload(text))

    assert reading.observations == ()
    (problem,) = reading.problems
    assert problem.source.startswith("AGI")


@pytest.mark.parametrize("named", [{}, {"frame_id": None}, {"frame_id": "\u0000"}])
def test_a_box_that_names_no_frame_is_read_without_one(
    named: dict[str, object],
) -> None:
    bare = {name: value for name, value in BOX.items() if name != "frame_id"}

    assert [one.frame_id for one in boxes({**bare, **named}).detections] == [None]


@pytest.mark.parametrize(
    "proof", [{"mono": -1.0}, {"heard": {"boot": "b"}}, {"heard": {"seq": 1}}]
)
def test_a_proof_of_age_that_is_none_is_refused(proof: dict[str, object]) -> None:
    payload = orjson.dumps({"base_pose_ground_truth": {**pose_value(), **proof}})

    assert codec.read_measure("AGI_odom", payload).problems


# --- size and depth (F26, F28) ----------------------------------------------------


@pytest.mark.parametrize("bracket", [b"[", b'{"a":'])
def test_f28_a_hundred_thousand_brackets_are_refused_at_once(bracket: bytes) -> None:
    body = bracket * 100_000
    started = time.thread_time()

    with pytest.raises(UnreadableError):
        codec.load_json(body)

    assert time.thread_time() - started < 0.1


@pytest.mark.parametrize("levels", [33, 900])
def test_the_limit_is_thirty_two_levels(levels: int) -> None:
    codec.load_json(b"[" * 32 + b"]" * 32)

    with pytest.raises(UnreadableError) as refused:
        codec.load_json(b"[" * levels + b"]" * levels)

    assert refused.value.reason == "too_deep"


def test_f26_five_megabytes_of_points_are_refused() -> None:
    payload = b'{"lidar_points": [' + b"1.0," * 1_250_000 + b"1.0]}"

    reading = codec.read_measure("AGI_lidar2D", payload)

    assert reading.observations == ()
    assert reading.problems[0].reason == "bad_lidar_points"


# --- text (F29, F32) --------------------------------------------------------------


@pytest.mark.parametrize(
    ("sent", "kept"),
    [
        ("\u202efarmer\u2066", "farmer"),
        ("e\u0301", "\u00e9"),
        ("x" * 10_000, "x" * 64),
    ],
)
def test_f29_text_is_cleaned_and_cut(sent: str, kept: str) -> None:
    frame = boxes({**BOX, "class_id": sent})

    assert frame.detections[0].class_id == kept


def test_f29_half_a_character_is_refused() -> None:
    payload = b'{"bounding_boxes": [{"class_id": "\\ud800"}]}'

    reading = codec.read_measure("AGI_yolox_bounding_boxes", payload)

    assert reading.problems[0].reason == "not_json"


def test_problems_never_carry_control_marks_into_the_log() -> None:
    kind = "Spy\r\nERROR all is lost"
    reading = codec.read_entity({"id": "a\nb\u202e", "type": kind})

    (problem,) = reading.problems
    assert problem.source == "ab"
    assert "\n" not in problem.detail


@pytest.mark.parametrize(
    "name", ["", "a/b", "a+", "#", "a b", "climate", "x" * 65, "ä"]
)
def test_f33_a_robot_id_that_could_be_a_topic_is_refused(name: str) -> None:
    assert codec.read_entity({"id": name, "type": "Robot"}).problems
    assert codec.read_measure(name, b"{}").problems


# --- neighbours -------------------------------------------------------------------


def test_one_bad_attribute_does_not_hurt_its_neighbours() -> None:
    body = notification(
        {
            "base_pose_ground_truth": {"x": "here"},
            "navigation": {"task": "harvest"},
            "safety_state": {"speed_factor": 2, "reason": "clear"},
        }
    )

    _, reading = codec.read_notification(body)

    assert [type(one) for one in reading.observations] == [Navigation]
    assert {one.reason for one in reading.problems} == {
        "bad_base_pose_ground_truth",
        "bad_safety_state",
    }


def test_one_bad_entity_does_not_hurt_its_neighbours() -> None:
    good = {"id": "AGI", "type": "Robot", "base_pose_ground_truth": pose_value()}
    body = {"subscriptionId": "s", "data": [{"id": 1}, {"type": "Robot"}, good]}

    _, reading = codec.read_notification(orjson.dumps(body))

    assert [type(one) for one in reading.observations] == [Odometry]
    assert len(reading.problems) == 2


@pytest.mark.parametrize(
    "body",
    [
        b'{"subscriptionId": 1, "data": []}',
        b'{"subscriptionId": "s", "data": [1]}',
        b"\xff\xfe",
        b'{"subscriptionId": "s", "data": []}trailing',
    ],
)
def test_what_is_no_notification_is_unreadable(body: bytes) -> None:
    with pytest.raises(UnreadableError):
        codec.read_notification(body)


CROWD = {f"R{number}": {"speed_factor": 1.0} for number in range(257)}


@pytest.mark.parametrize(
    "said",
    [{}, [], {"robot_id": 7}, {"robot_id": "A", "seen": 1},
     {"robot_id": "AGI", "speed_limits": CROWD}],
    ids=["nothing", "a list", "no name", "no counts", "more robots than a fleet has"],
)  # fmt: skip
def test_what_is_no_feedback_counts_as_none(said: object) -> None:
    with pytest.raises(UnreadableError):
        codec.read_feedback(orjson.dumps(said))


@pytest.mark.parametrize(
    "changes",
    [
        {"speed_factor": 1.5},
        {"reason": "because"},
        {"holds": [{"id": "x", "source": "me", "ack": "remote"}]},
        {"released": ["x"] * 65},
        {"v": True},
    ],
)
def test_a_safety_report_that_is_wrong_in_one_place_is_no_report(
    changes: dict[str, object],
) -> None:
    value = {"speed_factor": 1, "reason": "clear", **changes}

    reading = codec.read_measure("AGI_safety", orjson.dumps({"safety_state": value}))

    assert not [one for one in reading.observations if isinstance(one, SafetyReport)]
    assert reading.problems[0].reason == "bad_safety_state"


@pytest.mark.parametrize("speed", [100.1, -100.1])
def test_a_speed_that_no_machine_has_is_refused(speed: float) -> None:
    for key in ("linear_velocity", "angular_velocity"):
        value = {**pose_value(), key: speed}
        payload = orjson.dumps({"base_pose_ground_truth": value})
        assert codec.read_measure("AGI_odom", payload).problems


@pytest.mark.parametrize(
    ("said", "refused"),
    [
        ({"robot_id": "AGII"}, True),
        ({"robot_id": 7}, True),
        ({"robot_id": "AGI"}, False),
        ({"robot_id": None}, True),
    ],
    ids=str,
)
@pytest.mark.parametrize("inside", [True, False])
def test_a_message_that_names_another_robot_than_its_topic_is_refused(
    said: dict[str, object], *, refused: bool, inside: bool
) -> None:
    value = pose_value() | (said if inside else {})
    beside = {} if inside else said
    body = {"base_pose_ground_truth": value, **beside}

    direct = codec.read_measure("AGI_odom", orjson.dumps(body))
    _, notified = codec.read_notification(notification(body))

    for reading in (direct, notified):
        assert [one.reason for one in reading.problems] == ["another_robot"] * refused
        assert bool(reading.observations) is not refused


# --- frames that cannot be read --------------------------------------------------

HEADER = {"boot": "b", "seq": 1, "stamp": "2026-11-21T03:31:20.000Z"}


@pytest.mark.parametrize(
    "said",
    [
        {"bounding_boxes": [BOX] * 257, "detection_header": HEADER},
        {"bounding_boxes": [BOX], "detection_header": HEADER | {"stamp": 17e8}},
        {"bounding_boxes": [BOX], "detection_header": HEADER | {"robot_id": "AGII"}},
        {"bounding_boxes": "none", "detection_header": HEADER},
        {"class": "farmer", "conf": 0.9, "timestamp": 5},
        [],
        b"{",
        b'{"bounding_boxes": [NaN]}',
    ],
)
def test_a_frame_that_cannot_be_read_is_refused_and_never_an_empty_picture(
    said: object,
) -> None:
    payload = said if isinstance(said, bytes) else orjson.dumps(said)

    reading = codec.read_measure("AGI_yolox_bounding_boxes", payload)

    assert reading.observations == (RefusedFrame("AGI"),)
    assert len(reading.problems) == 1


def test_a_bad_box_keeps_the_good_ones_and_tells_its_class() -> None:
    turned = {**dict.fromkeys(("ymin", "ymax", "zmin", "zmax"), 0.0), "xmin": 2.0}
    bad: dict[str, dict[str, object]] = {
        "unsure": {"probability": 95},
        "no position": {"position": None},
        "ends before it begins": {"position": {**turned, "xmax": 1.0}},
        "unplaced": {"frame_id": "unplaced"},
    }
    told = [{**BOX, "class_id": name, **changes} for name, changes in bad.items()]
    unsure = {"class_id": "farmer", "position": BOX["position"]}

    frame = boxes(BOX, *told, unsure, {**unsure, "class_id": 7}, "no box at all")

    assert len(frame.detections) == 1
    assert frame.unread == (*bad, "farmer", None, None)


# --- scans that no laser makes -----------------------------------------------------


@pytest.mark.parametrize(
    ("header", "reasons"),
    [
        ({"angle_increment": 1e-4}, []),
        ({"angle_increment": -1e-300}, ["bad_lidar_header"]),
        ({"range_min": 9.0, "range_max": 9.0}, ["bad_lidar_header"]),
    ],
)
def test_a_scan_that_no_laser_makes_is_refused_with_its_reason(
    header: dict[str, float], reasons: list[str]
) -> None:
    usual = {"angle_min": 0.0, "angle_increment": 0.01, "range_max": 25.0}
    said = {"lidar_points": [1.5] * 360, "lidar_header": {**usual, **header}}

    reading = codec.read_attributes("AGI", said)

    assert len(reading.observations) == 1 - len(reasons)
    assert [one.reason for one in reading.problems] == reasons
