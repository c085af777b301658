"""The IoT Agent's north port: its groups and devices."""

from collections.abc import Sequence

from iveg.adapters.fiware_http import PROBE_TIMEOUT_S, Document, FiwareHttp
from iveg.ngsi import names

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

    async def create_group(self, group: Document) -> bool:
        """Make a group; False where there is one with this key already.

        Raises:
            HopError: the agent does not take it.
        """
        body = {"services": [group]}
        response = await self.ask("POST", "/iot/services", body=body, also=(409,))
        return response.status_code != 409

    async def change_group(self, apikey: str, changes: Document) -> None:
        """Change a group.

        Raises:
            HopError: the agent does not take it.
        """
        query = {"resource": RESOURCE, "apikey": apikey}
        await self.ask("PUT", "/iot/services", query=query, body=changes)

    async def read_devices(self) -> list[Document]:
        """The devices of our tenant.

        Raises:
            HopError: the agent does not answer.
        """
        return await self.read_all("/iot/devices", part="devices")

    async def create_device(self, device: Document) -> bool:
        """Make a device; False where there is one with this id already.

        Raises:
            HopError: the agent does not take it.
        """
        body = {"devices": [device]}
        response = await self.ask("POST", "/iot/devices", body=body, also=(409,))
        return response.status_code != 409

    async def delete_device(self, device_id: str) -> bool:
        """Delete a device; whether there was one.

        Raises:
            HopError: the agent does not answer.
        """
        path = f"/iot/devices/{device_id}"
        response = await self.ask("DELETE", path, also=(404,))
        return response.status_code != 404


def write_group(apikey: str, cbroker_url: str) -> Document:
    """The group of an API key as the agent is told."""
    return {
        "apikey": apikey,
        "resource": RESOURCE,
        "cbroker": cbroker_url,
        "entity_type": names.ROBOT_TYPE,
        "attributes": [],
        "lazy": [],
        "commands": [],
        "static_attributes": [],
        # A measure of a device that is not there makes nothing.
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
        "commands": _COMMANDS if has_command else [],
    }
