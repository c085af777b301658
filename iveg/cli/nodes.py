"""Settings of the safety nodes that a part runs, and the address of their broker."""

from pathlib import Path

from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.tls import TlsFiles
from iveg.domain.witness import Plan
from iveg.robot.node_settings import NodeSettings
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
        uplink=settings.uplink,
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
