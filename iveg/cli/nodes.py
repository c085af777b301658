"""Settings of the safety nodes that a part runs."""

from pathlib import Path

from iveg.cli.addresses import broker_of
from iveg.robot.node import NodeSettings
from iveg.settings import Settings


def node_settings(settings: Settings, directory: Path) -> NodeSettings:
    """As an operator chose; hold files below ``directory``."""
    return NodeSettings(
        address=broker_of(settings),
        apikey=settings.apikey,
        directory=directory,
        slow_s=settings.feedback_slow_s,
        stand_s=settings.feedback_stand_s,
        on_link_loss=settings.on_link_loss,
        uplink=settings.uplink,
    )
