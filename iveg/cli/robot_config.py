"""Configuration of ``iveg robot``: a file, and words of the command line instead."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from iveg.adapters.dds_network import DdsNetwork
from iveg.adapters.extras import require_extra
from iveg.domain.errors import DataFileError, SettingsError, UnreadableError
from iveg.robot.ros2.config import RobotConfig, read_classes, read_config

_DOMAINS = "a whole number from 0 to 232"


def load_config(
    options: argparse.Namespace, environment: Mapping[str, str]
) -> tuple[RobotConfig, tuple[str, ...]]:
    """Configuration of file and command line, and a detector's class list.

    Raises:
        DataFileError: a file or a name that cannot be used.
        SettingsError: invalid domain.
    """
    text, file = "", "robot.toml"
    if getattr(options, "config", None) is not None:
        file = str(options.config)
        text = _text_of(options.config)
    config = read_config(text, file)
    if options.ros_domain is None and "[ros]" not in text:
        options.ros_domain = _domain_of(environment)
    config = _with_words(config, options)
    try:
        _ = config.full_topics
    except UnreadableError as error:
        raise DataFileError("command line", "", f"{error.detail}.") from error
    if not config.class_list:
        return config, ()
    beside = options.config.parent if options.config is not None else Path()
    return config, read_classes(_text_of(beside / config.class_list))


def _domain_of(environment: Mapping[str, str]) -> int | None:
    said = environment.get("ROS_DOMAIN_ID", "")
    if not said:
        return None
    if not said.isdecimal():
        raise SettingsError("ROS_DOMAIN_ID", said, _DOMAINS)
    return int(said)


def _with_words(config: RobotConfig, options: argparse.Namespace) -> RobotConfig:
    domain, peers = options.ros_domain, options.ros_peer
    if domain is not None and not 0 <= domain <= 232:
        raise SettingsError("--ros-domain", str(domain), _DOMAINS)
    said = {
        "domain": domain,
        "namespace": getattr(options, "namespace", None),
        "interface": options.ros_interface,
        "peers": None if peers is None else tuple(peers),
    }
    topics = {key: getattr(options, key, None) for key in ("cmd_vel_in", "cmd_vel_out")}
    return replace(
        config,
        topics={**config.topics, **_without_none(topics)},
        **_without_none(said),
    )


def _without_none(said: Mapping[str, object]) -> dict[str, Any]:
    return {key: value for key, value in said.items() if value is not None}


def _text_of(file: Path) -> str:
    try:
        return file.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DataFileError(str(file), "", "cannot be read.") from error


def network_of(
    config: RobotConfig, environment: Mapping[str, str], what: str
) -> DdsNetwork:
    """DDS network for a command or option.

    Raises:
        MissingExtraError: Cyclone DDS is not installed.
    """
    require_extra("ros2", what)
    uri = environment.get("CYCLONEDDS_URI", "")
    return DdsNetwork(config.domain, config.interface, config.peers, uri)
