"""``iveg robot``: what it refuses before it touches anything, and in which words."""

import argparse
import asyncio
from pathlib import Path

import pytest

from iveg.cli import COMMANDS, robot
from iveg.cli.arguments import CommandCall, parser
from iveg.cli.nodes import load_config
from iveg.cli.robot import refuse_second_gate
from iveg.domain.errors import DataFileError, HopError, SettingsError
from iveg.ros2 import messages as ros
from iveg.settings import Settings
from tests.fakes.ros2_network import FakeNetwork, endpoint


def options(*words: str) -> argparse.Namespace:
    return parser(COMMANDS).parse_args(["robot", "--id", "AGI", *words])


@pytest.mark.parametrize("robot_id", ["climate", "A B", "a" * 65, "AGI;"])
def test_an_id_that_iveg_cannot_know_is_refused(robot_id: str, tmp_path: Path) -> None:
    asked = options()
    asked.id = robot_id

    with pytest.raises(SettingsError, match="--id"):
        robot.run(CommandCall(asked, Settings(), {}, tmp_path))


@pytest.mark.parametrize("domain", ["233", "-1"])
def test_a_domain_that_dds_does_not_have_is_refused(domain: str) -> None:
    with pytest.raises(DataFileError, match=r"ros\.domain"):
        load_config(options(f"--ros-domain={domain}"), {})


def test_words_count_before_the_file_and_the_file_before_the_environment(
    tmp_path: Path,
) -> None:
    file = tmp_path / "robot.toml"
    file.write_text('[ros]\ndomain = 7\nnamespace = "/a"\n')
    environment = {"ROS_DOMAIN_ID": "9"}
    words = options("--config", str(file), "--namespace", "/b", "--cmd-vel-in", "/go")

    config = load_config(words, environment)
    bare = load_config(options(), environment)
    worded = load_config(options("--ros-domain", "3"), environment)

    assert (config.ros.domain, bare.ros.domain, worded.ros.domain) == (7, 9, 3)
    topics = config.full_topics
    assert (topics["odometry"], topics["cmd_vel_in"]) == ("/b/odom", "/go")


def test_nobody_lets_a_robot_go_over_a_broker_that_is_not_here(
    tmp_path: Path,
) -> None:
    settings = Settings(mqtt_url="mqtt://farm.example:1883")
    pytest.importorskip("cyclonedds")

    with pytest.raises(SettingsError, match="--attended"):
        robot.run(CommandCall(options("--attended"), settings, {}, tmp_path))


# --- one gate a robot ---------------------------------------------------------------


async def test_a_drive_that_somebody_else_publishes_is_refused() -> None:
    network = FakeNetwork()
    network.others.append(endpoint("/cmd_vel", ros.Twist))

    with pytest.raises(HopError, match="/cmd_vel has a publisher already"):
        await refuse_second_gate(network, "/cmd_vel", 0.01, 0.2)


async def test_a_gate_that_was_killed_is_waited_for_until_it_is_forgotten() -> None:
    network = FakeNetwork()
    network.others.append(endpoint("/cmd_vel", ros.Twist))
    network.others.append(endpoint("/cmd_vel", ros.Twist, writes=False))
    asyncio.get_running_loop().call_later(0.1, network.others.pop, 0)

    await refuse_second_gate(network, "/cmd_vel", 0.01, 5.0)

    assert [one.writes for one in network.others] == [False]
