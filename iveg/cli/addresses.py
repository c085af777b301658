"""Where a part finds the others."""

from iveg.adapters.mqtt import BrokerAddress
from iveg.settings import Settings


def broker_of(settings: Settings) -> BrokerAddress:
    """Where the MQTT broker is and who we are there."""
    return BrokerAddress.from_url(
        settings.mqtt_url, settings.mqtt_user, settings.mqtt_password
    )
