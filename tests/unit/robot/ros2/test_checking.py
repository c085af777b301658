"""``iveg robot check`` says in one sentence each what is missing."""

import pytest

from iveg.robot.ros2.checking import CheckVerdict, Heard, judge, lines
from iveg.robot.ros2.config import DriveConfig, RobotConfig
from iveg.robot.ros2.transforms import TransformBuffer
from iveg.ros2 import messages as m
from iveg.ros2.names import SENSOR_DATA, TF, TF_STATIC, Endpoint
from tests.fakes.ros2_network import endpoint
from tests.unit.robot.ros2.said import WALL, link, tf

WHOLE = {
    "odometry": endpoint("/odom", m.Odometry),
    "scan": endpoint("/scan", m.LaserScan, qos=SENSOR_DATA),
    "tf": endpoint("/tf", m.TFMessage, qos=TF),
    "tf_static": endpoint("/tf_static", m.TFMessage, qos=TF_STATIC),
    "wishes": endpoint("/cmd_vel_nav", m.Twist),
    "base": endpoint("/cmd_vel", m.Twist, writes=False),
}


def tree(*, localised: bool = True) -> TransformBuffer:
    found = TransformBuffer(0.5)
    found.add(tf(link("base_link", "laser")), static=True)
    found.add(tf(link("odom", "base_link")), static=False)
    if localised:
        found.add(tf(link("map", "odom")), static=False)
    return found


def heard(**differs: int) -> dict[str, Heard]:
    counts = {"odometry": 90, "scan": 30, "tf": 90, "tf_static": 1} | differs
    return {
        topic: Heard(count, 0, 0.02, "laser" if topic == "scan" else "odom")
        for topic, count in counts.items()
    }


def verdict(
    *more: Endpoint,
    without: str = "",
    config: RobotConfig | None = None,
    said: dict[str, Heard] | None = None,
    buffer: TransformBuffer | None = None,
    broker: str | None = None,
) -> CheckVerdict:
    endpoints = [one for name, one in WHOLE.items() if name != without]
    return judge(
        config or RobotConfig(),
        [*endpoints, *more],
        said or heard(),
        buffer or tree(),
        seconds=3.0,
        stamp=WALL,
        broker=broker,
    )


def test_a_robot_that_has_everything_misses_nothing() -> None:
    found = verdict()

    assert found.missing == ()
    assert found.chain == "map → odom → base_link → laser"
    odometry = next(row for row in found.rows if row.topic == "/odom")
    assert (odometry.writers, odometry.rate_hz, odometry.age_s) == (1, 30.0, 0.02)
    assert lines(found)[-1] == "Nothing is missing."


@pytest.mark.parametrize(
    ("found", "sentence"),
    [
        (
            verdict(without="odometry"),
            "Nobody publishes /odom (nav_msgs/msg/Odometry): without it the robot "
            "stands.",
        ),
        (
            verdict(without="base"),
            "Nobody listens on /cmd_vel: is the base running?",
        ),
        (
            verdict(without="wishes"),
            "Nobody publishes /cmd_vel_nav: is navigation running?",
        ),
        (
            verdict(endpoint("/cmd_vel", m.Twist)),
            "Somebody else publishes /cmd_vel: only the gate may, remap it to "
            "/cmd_vel_nav.",
        ),
        (
            verdict(endpoint("/cmd_vel_nav", m.Twist, writes=False)),
            "Somebody listens on /cmd_vel_nav beside the gate: a base that does goes "
            "round it.",
        ),
        (
            verdict(endpoint("/scan", m.PointCloud2), without="scan"),
            "/scan is sensor_msgs/msg/PointCloud2, not sensor_msgs/msg/LaserScan.",
        ),
        (
            verdict(endpoint("/tf", m.TFMessage, qos=SENSOR_DATA), without="tf"),
            "/tf: asked for reliably, published best effort; say so in [qos].",
        ),
        (
            verdict(endpoint("/tf_static", m.TFMessage), without="tf_static"),
            "/tf_static: asked for transient local, published volatile; say so in "
            "[qos].",
        ),
        (
            verdict(said=heard(odometry=3)),
            "/odom has a publisher and comes 1.0 times a second.",
        ),
        (
            verdict(buffer=tree(localised=False)),
            "TF: no map → odom.",
        ),
        (
            verdict(config=RobotConfig(drive=DriveConfig(stamped_out=True))),
            "/cmd_vel is geometry_msgs/msg/Twist there: drive.stamped_out.",
        ),
        (
            verdict(config=RobotConfig(drive=DriveConfig(stamped_in=True))),
            "/cmd_vel_nav is geometry_msgs/msg/Twist there: drive.stamped_in.",
        ),
        (verdict(broker="No MQTT broker answers."), "No MQTT broker answers."),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_missing_is_said_in_one_sentence(
    found: CheckVerdict, sentence: str
) -> None:
    assert list(found.missing) == [sentence]


def test_a_domain_where_nobody_is_says_so_once() -> None:
    found = judge(
        RobotConfig(domain=7),
        [endpoint("/cmd_vel", m.Twist, own=True)],
        {},
        TransformBuffer(),
        seconds=3.0,
        stamp=WALL,
        broker=None,
    )

    (sentence,) = found.missing
    assert "DDS domain 7" in sentence
