"""Requests to the IoT Agent's north port: groups and devices."""

from collections.abc import Sequence

from iveg.adapters.fiware_http import PROBE_TIMEOUT_S, Document, FiwareHttp
from iveg.ngsi import names

GROUPS, DEVICES = "/iot/services", "/iot/devices"
RESOURCE = "/iot/json"
_COMMANDS = [{"name": name, "type": "command"} for name in names.COMMANDS]


class IotAgentClient(FiwareHttp):
    """Requests to the IoT Agent JSON."""

    HOP = "iot_agent"

    async def version(self) -> str:
        """The agent's version.

        Raises:
            HopError: the agent does not answer.
        """
        response = await self.ask("GET", "/iot/about", timeout_s=PROBE_TIMEOUT_S)
        return str(self.read_object(response).get("version", "unknown"))


def write_group(apikey: str, cbroker_url: str) -> Document:
    """The group of an API key as it is sent to the agent."""
    return {
        "apikey": apikey,
        "resource": RESOURCE,
        "cbroker": cbroker_url,
        "entity_type": names.ROBOT_TYPE,
        "attributes": [],
        "lazy": [],
        "commands": [],
        "static_attributes": [],
        # A measure of an unknown device must not create an entity.
        "autoprovision": False,
    }


def write_device(
    device_id: str,
    entity: str,
    kind: str,
    attributes: Sequence[tuple[str, str]],
    apikey: str,
    *,
    has_command: bool = False,
) -> Document:
    """A device as it is sent to the agent; ``attributes`` are names and NGSI types."""
    return {
        "device_id": device_id,
        "entity_name": entity,
        "entity_type": kind,
        "apikey": apikey,
        "protocol": names.PROTOCOL,
        "transport": "MQTT",
        "attributes": [
            {"object_id": name, "name": name, "type": kind} for name, kind in attributes
        ],
        # On one device alone: of several the agent would choose one for a command.
        "commands": _COMMANDS if has_command else [],
    }
