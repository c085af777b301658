"""``robot.toml``: ROS's defaults where nothing is said, a key where it is wrong."""

import re

import pytest

from iveg.domain.errors import DataFileError
from iveg.robot.ros2.config import RobotConfig, read_config
from iveg.ros2 import names
from iveg.ros2.names import Qos

WHOLE = """\
[ros]
domain = 7
namespace = "/agi"

[topics]
odometry = "odometry/filtered"
tf = "/tf"
battery = ""

[frames]
map = "/world"

[drive]
stamped_in = true
max_speed = 0.6

[qos.scan]
reliable = true
depth = 2
"""


def test_what_is_said_counts_and_the_rest_stays() -> None:
    config = read_config(WHOLE, "robot.toml")

    topics = config.full_topics
    assert config.ros.domain == 7
    assert topics["odometry"] == "/agi/odometry/filtered"
    assert topics["scan"] == "/agi/scan"
    assert (topics["tf"], topics["battery"]) == ("/tf", "")
    assert (config.frames.map, config.frames.odom) == ("world", "odom")
    assert (config.drive.stamped_in, config.drive.max_speed) == (True, 0.6)
    assert config.quality("scan") == Qos(reliable=True, depth=2)
    assert config.quality("tf") == names.TF


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("[ros]\nnamespace = '/a b'\n", ", ros.namespace: '/a b' is not a ROS"),
        ("[topics]\nscna = 'scan'\n", ", topics.scna.[key]: is unknown; known are"),
        ("[drive]\nstamped_in = 1\n", ", drive.stamped_in: Input should be a valid"),
        ("[qos.scan]\ndepth = 0\n", ", qos.scan.depth: Input"),
        ("[ros]\ndomain == 3\n", ": is not TOML"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_with_its_key(
    text: str, where: str
) -> None:
    with pytest.raises(DataFileError, match=re.escape(f"robot.toml{where}")):
        read_config(text, "robot.toml")


def test_a_namespace_of_the_command_line_is_held_to_the_same_rule() -> None:
    with pytest.raises(DataFileError, match=r"command line, ros\.namespace"):
        RobotConfig().with_words({"namespace": "/a;b"}, {})
