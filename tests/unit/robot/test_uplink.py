"""Algorithm 1: what leaves the robot."""

from dataclasses import replace

import numpy as np
import orjson
import pytest

from iveg.domain.observations import (
    Battery,
    CommandAnswer,
    Detection,
    DetectionFrame,
    FeedbackRef,
    Instant,
    LaserScan,
    Navigation,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.lab.embedded.orion_numbers import print_value
from iveg.ngsi import codec
from iveg.robot.echo import Echo
from iveg.robot.rates import LEVELS
from iveg.robot.uplink import Uplink
from tests.builders import START, detection, detection_frame, odometry, scan

AT = Instant(7.25, START.wall)
BLANK = Origin()


class Wire:
    """Keeps what an uplink offered."""

    def __init__(self, form: str = "per-topic", echo: Echo | None = None) -> None:
        self.sent: list[tuple[str, bytes]] = []
        self.uplink = Uplink(
            "AGI",
            "iveg",
            "boot-a",
            lambda topic, payload: self.sent.append((topic, payload)),
            form="single" if form == "single" else "per-topic",
            first_report=700,
            echo=echo,
        )

    def read(self) -> list[object]:
        """What iVeg makes of all that was sent."""
        return [
            observation
            for topic, payload in self.sent
            for observation in codec.read_measure(
                topic.split("/")[2], payload
            ).observations
        ]


@pytest.mark.parametrize(
    ("observation", "topic"),
    [
        (odometry(origin=BLANK), "/iveg/AGI_odom/attrs"),
        (scan(origin=BLANK), "/iveg/AGI_lidar2D/attrs"),
        (detection_frame(origin=BLANK), "/iveg/AGI_yolox_bounding_boxes/attrs"),
        (Navigation("", BLANK, "drive", (1.0, 2.0)), "/iveg/AGI_nav/attrs"),
    ],
)
def test_each_sensor_has_its_topic_and_each_message_its_origin(
    observation: Odometry | LaserScan | DetectionFrame | Navigation, topic: str
) -> None:
    wire = Wire()
    wire.uplink.send(replace(observation, robot_id=""), AT)
    wire.uplink.send(observation, AT.later(1.0))
    assert [where for where, _ in wire.sent] == [topic, topic]
    first, second = wire.read()
    assert isinstance(first, type(observation))
    assert isinstance(second, type(observation))
    assert first.robot_id == "AGI"
    assert first.origin == Origin(
        "boot-a", 1, "2023-11-14T22:13:20.000Z", AT.wall, AT.mono
    )
    assert second.origin.seq == 2


def test_every_topic_counts_for_itself() -> None:
    wire = Wire()
    wire.uplink.send(odometry(origin=BLANK), AT)
    wire.uplink.send(scan(origin=BLANK), AT)
    read = wire.read()
    assert [one.origin.seq for one in read if hasattr(one, "origin")] == [1, 1]


def test_a_report_tells_its_place_in_the_count() -> None:
    wire = Wire()
    seqs = []
    for _ in range(2):
        seq, (direct, measure) = wire.uplink.report(
            SafetyReport("AGI", BLANK, 0.5, "person"), AT
        )
        seqs.append(seq)
        (said,) = codec.read_measure("AGI_safety", measure.payload).observations
        assert isinstance(said, SafetyReport)
        assert said.origin.seq == seq
        assert direct.payload == measure.payload
    assert seqs == [700, 701]
    assert direct.topic == "/AGI/iveg/safety"
    assert measure.topic == "/iveg/AGI_safety/attrs"


def test_a_report_for_iveg_alone_goes_past_the_agent_in_the_same_count() -> None:
    wire = Wire()
    report = SafetyReport("AGI", BLANK, 0.0, "hold")
    first, messages = wire.uplink.report(report, AT, is_measure=False)
    second, _ = wire.uplink.report(report, AT)
    assert [one.topic for one in messages] == ["/AGI/iveg/safety"]
    assert (first, second) == (700, 701)


def test_an_answer_goes_to_cmdexe_with_its_origin() -> None:
    wire = Wire()
    message = wire.uplink.answer(CommandAnswer("AGI", BLANK, "01A", "LATCHED"), AT)
    assert message.topic == "/iveg/AGI/cmdexe"
    (said,) = codec.read_answer("AGI", message.payload).observations
    assert isinstance(said, CommandAnswer)
    assert (said.id, said.result) == ("01A", "LATCHED")
    assert (said.origin.boot, said.origin.seq) == ("boot-a", 1)


@pytest.mark.parametrize("form", ["per-topic", "single"])
def test_every_message_tells_what_had_been_heard_when_it_was_measured(
    form: str,
) -> None:
    echo = Echo()
    wire = Wire(form, echo)
    wire.uplink.send(odometry(origin=BLANK), AT)
    echo.note(Origin("iveg", 41))
    for one in (scan(origin=BLANK), detection_frame("AGI", detection(), origin=BLANK)):
        wire.uplink.send(one, AT)
    wire.uplink.send(odometry(origin=BLANK), AT)

    first, *others = [one.origin for one in wire.read() if hasattr(one, "origin")]

    assert (first.acknowledgements, first.heard, first.mono) == (True, None, AT.mono)
    assert len(others) == 3
    assert {(one.acknowledgements, one.heard) for one in others} == {
        (True, FeedbackRef("iveg", 41))
    }


def test_a_report_tells_what_had_been_heard() -> None:
    echo = Echo()
    echo.note(Origin("iveg", 41))
    _, (_, message) = Wire(echo=echo).uplink.report(
        SafetyReport("AGI", BLANK, 1.0, "clear"), AT
    )

    (said,) = codec.read_measure("AGI_safety", message.payload).observations

    assert isinstance(said, SafetyReport)
    assert (said.origin.heard, said.origin.mono) == (FeedbackRef("iveg", 41), AT.mono)


def test_a_recording_proves_nothing() -> None:
    wire = Wire()
    wire.uplink.send(odometry(origin=BLANK), AT)

    (said,) = wire.read()
    assert isinstance(said, Odometry)
    assert not said.origin.acknowledgements


@pytest.mark.parametrize("form", ["per-topic", "single"])
def test_a_scan_travels_with_every_digit_of_its_float32_even_through_orion(
    form: str,
) -> None:
    measured = np.random.default_rng(1).uniform(0.1, 30.0, 720).astype(np.float32)
    wire = Wire(form)
    wire.uplink.send(scan(ranges=measured.tolist(), origin=BLANK), AT)
    wire.uplink.send(odometry(origin=BLANK), AT)
    (payload,) = [one for _, one in wire.sent if b"lidar_header" in one]
    told = orjson.loads(payload)
    ranges = told.get("lidar_points") or told["laser_scan"]
    by_orion = orjson.loads(print_value(ranges))
    assert np.array_equal(np.array(ranges, np.float32), measured)
    assert np.array_equal(np.array(by_orion, np.float32), measured)
    # In no more digits than that takes.
    assert [float(str(np.float32(one))) for one in ranges] == ranges


# --- an agent that is behind --------------------------------------------------------


def test_what_the_agent_is_spared_goes_straight_to_iveg_in_the_same_count() -> None:
    wire = Wire()
    wire.uplink.rates.level = LEVELS
    for tick in range(30):
        wire.uplink.send(odometry(origin=BLANK), Instant(tick / 30, START.wall))
    topics = [topic for topic, _ in wire.sent]
    assert set(topics) == {"/iveg/AGI_odom/attrs", "/AGI/iveg/odom"}
    assert topics.count("/iveg/AGI_odom/attrs") in (5, 6)
    assert len(topics) == 30
    read = [
        observation
        for _, payload in wire.sent
        for observation in codec.read_measure("AGI_odom", payload).observations
    ]
    assert [one.origin.seq for one in read if isinstance(one, Odometry)] == list(
        range(1, 31)
    )


@pytest.mark.parametrize(
    "seen",
    [
        (),
        (detection("farmer", 2.0), detection("farmer", 8.0)),
        (detection("robot", 2.0),),
        (detection("farmer", 2.0, probability=0.6),),
    ],
    ids=["nobody", "one more", "another class", "less sure"],
)
def test_a_look_that_sees_others_goes_through_the_agent_at_once(
    seen: tuple[Detection, ...],
) -> None:
    wire = Wire()
    wire.uplink.rates.level = LEVELS
    before = detection_frame("AGI", detection("farmer", 2.0), origin=BLANK)
    wire.uplink.send(before, Instant(0.0, START.wall))
    wire.uplink.send(before, Instant(0.03, START.wall))
    wire.uplink.send(
        detection_frame("AGI", *seen, origin=BLANK), Instant(0.06, START.wall)
    )
    assert [topic for topic, _ in wire.sent] == [
        "/iveg/AGI_yolox_bounding_boxes/attrs",
        "/AGI/iveg/yolox_bounding_boxes",
        "/iveg/AGI_yolox_bounding_boxes/attrs",
    ]


# --- the single payload -------------------------------------------------------------


def test_the_single_payload_leaves_once_an_odometry_tick() -> None:
    wire = Wire("single")
    wire.uplink.send(scan(origin=BLANK), AT)
    wire.uplink.send(detection_frame("AGI", detection(), origin=BLANK), AT)
    assert wire.sent == []
    wire.uplink.send(odometry(origin=BLANK), AT)
    ((topic, payload),) = wire.sent
    assert topic == "/iveg/AGI/attrs"
    fields = {"class", "conf", "position_3D", "pose", "laser_scan", "timestamp"}
    assert fields <= orjson.loads(payload).keys()


def test_iveg_reads_pose_scan_and_detection_from_the_single_payload() -> None:
    wire = Wire("single")
    sweep = scan(ranges=[1.0, np.inf, 2.0], angle_min=-1.0, origin=BLANK)
    found = detection("farmer", 3.0, 4.0, probability=0.9)
    wire.uplink.send(sweep, AT)
    wire.uplink.send(detection_frame("AGI", found, origin=BLANK), AT)
    wire.uplink.send(odometry(x=1.0, y=2.0, yaw=0.5, origin=BLANK), AT)
    pose, swept, looked = wire.read()
    assert isinstance(pose, Odometry)
    assert (pose.pose.x, pose.pose.y, pose.origin.seq) == (1.0, 2.0, 1)
    assert isinstance(swept, LaserScan)
    assert swept.angle_min == -1.0
    assert np.array_equal(swept.ranges, sweep.ranges)
    assert isinstance(looked, DetectionFrame)
    assert looked.detections[0].class_id == "farmer"
    assert looked.detections[0].box.centre[:2] == pytest.approx((3.0, 4.0))


def test_a_detection_in_base_link_travels_in_map() -> None:
    wire = Wire("single")
    ahead = replace(detection(x=2.0), frame_id="base_link")
    wire.uplink.send(detection_frame("AGI", ahead, origin=BLANK), AT)
    wire.uplink.send(odometry(x=5.0, y=5.0, yaw=np.pi / 2, origin=BLANK), AT)
    position = orjson.loads(wire.sent[0][1])["position_3D"]
    assert (position["x"], position["y"]) == pytest.approx((5.0, 7.0))


def test_several_detections_of_one_look_take_turns_surest_first() -> None:
    wire = Wire("single")
    look = detection_frame(
        "AGI",
        detection(probability=0.81),
        detection(probability=0.95),
        origin=BLANK,
    )
    wire.uplink.send(look, AT)
    for _ in range(3):
        wire.uplink.send(odometry(origin=BLANK), AT)
    told = [orjson.loads(payload).get("conf") for _, payload in wire.sent]
    assert told == [0.95, 0.81, None]


def test_a_look_that_saw_nothing_is_said_once() -> None:
    wire = Wire("single")
    wire.uplink.send(detection_frame("AGI", origin=BLANK), AT)
    for _ in range(2):
        wire.uplink.send(odometry(origin=BLANK), AT)
    looks = [one for one in wire.read() if isinstance(one, DetectionFrame)]
    assert [look.detections for look in looks] == [()]


def test_a_scan_travels_once() -> None:
    wire = Wire("single")
    wire.uplink.send(scan(origin=BLANK), AT)
    for _ in range(2):
        wire.uplink.send(odometry(origin=BLANK), AT)
    assert sum(isinstance(one, LaserScan) for one in wire.read()) == 1


def test_intent_keeps_its_own_topic_in_the_single_form() -> None:
    wire = Wire("single")
    wire.uplink.send(Navigation("", BLANK, "drive"), AT)
    assert wire.sent[0][0] == "/iveg/AGI_nav/attrs"


def test_a_small_sensor_speaks_for_itself_beside_the_single_payload() -> None:
    wire = Wire("single")

    wire.uplink.send(Battery("AGI", BLANK, 0.5), AT)

    (said,) = wire.read()
    assert isinstance(said, Battery)
    assert said.percentage == 0.5
