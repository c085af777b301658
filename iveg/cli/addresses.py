"""Addresses of the parts, from the settings."""

from iveg.adapters.mqtt import BrokerAddress
from iveg.settings import Settings


def broker_of(settings: Settings) -> BrokerAddress:
    """Address of the MQTT broker with user and password."""
    return BrokerAddress.from_url(
        settings.mqtt_url, settings.mqtt_user, settings.mqtt_password
    )
