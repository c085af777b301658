"""Orion and the IoT Agent as the settings say, and the token of a proxy there."""

from iveg.adapters import clock
from iveg.adapters.bounded_json import BoundedJson
from iveg.adapters.fiware_http import HOP, FiwareToken, TokenGrant
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.orion import OrionClient
from iveg.settings import Settings


def open_fiware(settings: Settings) -> tuple[OrionClient, IotAgentClient]:
    """Both, with one token where a proxy asks for it; nothing is connected yet.

    Who closes one of them closes the other, too.
    """
    tenant = settings.fiware_service, settings.fiware_servicepath
    access = open_token(settings)
    return (
        OrionClient(settings.orion_url, *tenant, access),
        IotAgentClient(settings.iota_url, *tenant, access),
    )


def open_token(settings: Settings) -> FiwareToken | None:
    """The token that a proxy asks for; None where the settings name no endpoint."""
    if not settings.fiware_token_url:
        return None
    grant = TokenGrant(
        settings.fiware_token_url,
        settings.fiware_client_id,
        settings.fiware_client_secret,
        settings.fiware_user,
        settings.fiware_password,
        settings.fiware_scope,
        settings.fiware_token_header,
    )
    return FiwareToken(grant, clock.mono, BoundedJson(HOP))
