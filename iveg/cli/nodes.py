"""Settings of safety nodes that a command runs: broker, configuration and network."""

import argparse
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from iveg.adapters.dds_network import DdsNetwork
from iveg.adapters.extras import require_extra
from iveg.adapters.mqtt import BrokerAddress, TlsFiles
from iveg.adapters.toml_files import read_text
from iveg.domain.errors import SettingsError
from iveg.domain.laser import Plan
from iveg.robot.judgement import Limits
from iveg.robot.node import NodeSettings
from iveg.robot.ros2.config import RobotConfig, read_config
from iveg.settings import Settings

_log = logging.getLogger(__name__)


def node_settings(
    settings: Settings, directory: Path, plan: Plan | None = None
) -> NodeSettings:
    """Settings of a node, from an operator's; hold files are below ``directory``.

    ``plan``: fixed things in the greenhouse; None: unknown.
    """
    return NodeSettings(
        address=broker_of(settings),
        apikey=settings.apikey,
        directory=directory,
        limits=Limits(
            slow_s=settings.feedback_slow_s,
            stand_s=settings.feedback_stand_s,
            on_link_loss=settings.on_link_loss,
            plan=plan,
        ),
    )


def broker_of(settings: Settings) -> BrokerAddress:
    """Address of the MQTT broker with user and password."""
    return BrokerAddress.from_url(
        settings.mqtt_url,
        settings.mqtt_user,
        settings.mqtt_password,
        TlsFiles(settings.mqtt_ca, settings.mqtt_cert, settings.mqtt_key),
    )


def load_config(
    options: argparse.Namespace, environment: Mapping[str, str]
) -> RobotConfig:
    """Configuration of a robot, from its file and the command line.

    Raises:
        DataFileError: the file or an argument cannot be used.
    """
    config, file = RobotConfig(), getattr(options, "config", None)
    if file is not None:
        config = read_config(read_text(str(file)), str(file))
    if config.detector.classes:
        _log.warning("%s: detector.classes is not read; the fleet file has them", file)
    domain = options.ros_domain
    # The command line counts first, then the file, then the environment.
    if domain is None and "domain" not in config.ros.model_fields_set:
        domain = _domain_of(environment)
    ros = {
        "domain": domain,
        "namespace": getattr(options, "namespace", None),
        "interface": options.ros_interface,
        "peers": options.ros_peer,
    }
    topics = {key: getattr(options, key, None) for key in ("cmd_vel_in", "cmd_vel_out")}
    return config.with_words(_without_none(ros), _without_none(topics))


def _domain_of(environment: Mapping[str, str]) -> int | None:
    text = environment.get("ROS_DOMAIN_ID", "")
    if text and not text.isdecimal():
        raise SettingsError("ROS_DOMAIN_ID", text, "a whole number from 0 to 232")
    return int(text) if text else None


def _without_none(values: Mapping[str, object]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


def network_of(
    config: RobotConfig, environment: Mapping[str, str], what: str
) -> DdsNetwork:
    """DDS network for a command or option.

    Raises:
        MissingExtraError: Cyclone DDS is not installed.
    """
    require_extra("ros2", what)
    uri = environment.get("CYCLONEDDS_URI", "")
    ros = config.ros
    return DdsNetwork(ros.domain, ros.interface, ros.peers, uri)
