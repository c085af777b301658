"""Settings of the safety nodes that a part runs: broker, robot's file and network."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from iveg.adapters.dds_network import DdsNetwork
from iveg.adapters.extras import require_extra
from iveg.adapters.mqtt import BrokerAddress, TlsFiles
from iveg.domain.errors import DataFileError, SettingsError, UnreadableError
from iveg.domain.witness import Plan
from iveg.domain.words import read_classes
from iveg.robot.node import NodeSettings
from iveg.robot.ros2.config import RobotConfig, read_config
from iveg.settings import Settings


def node_settings(
    settings: Settings, directory: Path, plan: Plan | None = None
) -> NodeSettings:
    """As an operator chose; hold files below ``directory``.

    ``plan``: what stands in the greenhouse; None: nobody drew it.
    """
    return NodeSettings(
        address=broker_of(settings),
        apikey=settings.apikey,
        directory=directory,
        slow_s=settings.feedback_slow_s,
        stand_s=settings.feedback_stand_s,
        on_link_loss=settings.on_link_loss,
        plan=plan,
    )


def broker_of(settings: Settings) -> BrokerAddress:
    """Address of the MQTT broker with user and password."""
    return BrokerAddress.from_url(
        settings.mqtt_url,
        settings.mqtt_user,
        settings.mqtt_password,
        TlsFiles(settings.mqtt_ca, settings.mqtt_cert, settings.mqtt_key),
    )


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
    names = beside / config.class_list
    try:
        return config, read_classes(_text_of(names))
    except UnreadableError as error:
        raise DataFileError(str(names), error.reason, f"{error.detail}.") from error


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
