"""What the documents say of ROS 2 is what the code has."""

import json
import re

import pytest

from iveg import cli
from iveg.cli.arguments import parser
from iveg.robot.ros2.config import RobotConfig, read_config
from iveg.robot.ros2.topics import TOPICS
from tests.architecture import documents
from tests.processes import ROOT

ROBOTS = (ROOT / "docs/robots.md").read_text()
COMMANDS = (documents.INTERFACES / "cli.md").read_text()


def test_the_robot_toml_of_the_page_says_the_defaults() -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", ROBOTS, re.DOTALL)

    config = read_config(text, "docs/robots.md")

    assert config.full_topics == RobotConfig().full_topics
    assert config.frames == RobotConfig().frames
    assert all(config.quality(key) == RobotConfig().quality(key) for key in TOPICS)
    assert (config.transforms, config.detector) == (
        RobotConfig().transforms,
        RobotConfig().detector,
    )


def test_every_word_of_the_command_line_is_in_the_contract() -> None:
    usage = vars(parser(cli.COMMANDS).parse_args(["robot", "--id", "AGI"]))
    names = usage.keys() - {"action", "command", "module", "verbose"}
    words = {f"--{name.replace('_', '-')}" for name in names}

    assert {word for word in words if word not in COMMANDS} == set()


@pytest.mark.parametrize("language", ["en", "es"])
def test_every_fault_that_a_card_words_is_on_the_page(language: str) -> None:
    words = json.loads((ROOT / f"iveg/static/i18n/{language}.json").read_text())

    missing = {
        code
        for code in words["robot"]["fault"]
        if code != "other" and f"`{code}`" not in ROBOTS
    }
    assert missing == set()
