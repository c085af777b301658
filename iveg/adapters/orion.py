"""Requests to Orion: commands, entities, subscriptions, registrations.

Orion's 204 to a command proves nothing: it also answers so when the command went
nowhere (docs/fiware.md).  The evidence is the robot's own answer.
"""

from collections.abc import Mapping

from iveg.adapters.fiware_http import (
    PROBE_TIMEOUT_S,
    TIMEOUT_S,
    Document,
    FiwareHttp,
)
from iveg.domain.errors import HopError
from iveg.ngsi import names

ROBOT_ATTRIBUTES = (
    names.ODOMETRY,
    names.LIDAR,
    names.LIDAR_HEADER,
    names.BOXES,
    names.BOXES_HEADER,
    names.SAFETY,
    names.NAVIGATION,
    names.COMMAND_STATUS,
    names.COMMAND_INFO,
    names.GOAL_INFO,
    *names.ALGORITHM_1,
)
"""Attributes read of a robot.  Never ``cmd`` or ``goal``, for which Orion would
query the agent."""


class OrionClient(FiwareHttp):
    """Requests to Orion."""

    HOP = "orion"

    async def version(self) -> str:
        """Orion's version.

        Raises:
            HopError: Orion does not answer.
        """
        answer = self.read_object(await self.ask("GET", "/version"))
        return str(answer.get("orion", {}).get("version", "unknown"))

    async def update_command(
        self,
        robot_id: str,
        value: Mapping[str, object],
        timeout_s: float = 1.5,
        name: str = names.COMMAND,
    ) -> None:
        """Ask Orion to pass a command on.

        ``cmd`` goes alone, with ``?type=Robot`` and as an update: anything else makes
        Orion store or lose it and still answer 204.  A return therefore proves
        nothing; an error may still mean that the command arrives later.

        Args:
            robot_id: The robot.
            value: The command (docs/interfaces/commands.md).
            timeout_s: How long Orion may take (s).
            name: Of the NGSI command.

        Raises:
            HopError: Orion did not take it; 404 also means that the agent is away.
        """
        await self.ask(
            "PATCH",
            f"/v2/entities/{robot_id}/attrs",
            query={"type": names.ROBOT_TYPE},
            body={name: {"type": "command", "value": dict(value)}},
            timeout_s=timeout_s,
        )

    async def read_robots(self) -> list[Document]:
        """Every robot that Orion knows, as ``ngsi.codec.read_entity`` takes them.

        Raises:
            HopError: Orion does not answer.
        """
        query = {
            "type": names.ROBOT_TYPE,
            "attrs": ",".join(ROBOT_ATTRIBUTES),
            "orderBy": "id",
            "options": "skipForwarding",
        }
        return await self.read_all("/v2/entities", query)

    async def read_probe(self) -> Document | None:
        """The heartbeat probe as Orion has it; None where none ever came so far.

        Raises:
            HopError: Orion does not answer at once.
        """
        return await self._read_entity(
            names.HEARTBEAT_ID,
            {"type": names.HEARTBEAT_TYPE, "attrs": "probe"},
            PROBE_TIMEOUT_S,
        )

    async def delete_attribute(self, robot_id: str, name: str) -> bool:
        """Delete an attribute of a robot; whether there was one.

        Raises:
            HopError: Orion does not answer.
        """
        response = await self.ask(
            "DELETE",
            f"/v2/entities/{robot_id}/attrs/{name}",
            query={"type": names.ROBOT_TYPE},
            also=(404,),
        )
        return response.status_code != 404

    async def has_attribute(self, robot_id: str, name: str) -> bool:
        """Whether Orion itself keeps an attribute of a robot.

        Raises:
            HopError: Orion does not answer.
        """
        query = {
            "type": names.ROBOT_TYPE,
            "attrs": name,
            "options": "skipForwarding",
        }
        return name in (await self._read_entity(robot_id, query) or {})

    async def _read_entity(
        self, entity_id: str, query: Mapping[str, str], timeout_s: float = TIMEOUT_S
    ) -> Document | None:
        """An entity as Orion has it; None where it has none."""
        path = f"/v2/entities/{entity_id}"
        response = await self.ask(
            "GET", path, query=query, timeout_s=timeout_s, also=(404,)
        )
        entity = self.read_object(response)
        return None if response.status_code == 404 else entity

    # --- subscriptions and registrations ------------------------------------------

    async def read_registrations(self) -> list[Document]:
        """Every registration of our tenant.

        Raises:
            HopError: Orion does not answer.
        """
        return await self.read_all("/v2/registrations")

    async def delete_registration(self, registration_id: str) -> None:
        """Delete a registration; one that is gone already is no error.

        Raises:
            HopError: Orion does not answer.
        """
        path = f"/v2/registrations/{registration_id}"
        await self.ask("DELETE", path, also=(404,))

    async def read_subscriptions(self) -> list[Document]:
        """Every subscription of our tenant.

        Raises:
            HopError: Orion does not answer.
        """
        return await self.read_all("/v2/subscriptions")

    async def create_subscription(self, document: Document) -> str:
        """Subscribe; the id of the subscription.

        Raises:
            HopError: Orion does not take it.
        """
        response = await self.ask("POST", "/v2/subscriptions", body=dict(document))
        made = str(response.headers.get("Location", "").rpartition("/")[2])
        if not made:
            raise HopError("orion", "took a subscription and did not say where it is")
        return made

    async def update_subscription(
        self, subscription_id: str, changes: Document
    ) -> None:
        """Change a subscription; each part that is named replaces the old one whole.

        Raises:
            HopError: Orion does not take it.
        """
        path = f"/v2/subscriptions/{subscription_id}"
        await self.ask("PATCH", path, body=dict(changes))

    async def delete_subscription(self, subscription_id: str) -> None:
        """Delete a subscription; one that is gone already is no error.

        Raises:
            HopError: Orion does not answer.
        """
        path = f"/v2/subscriptions/{subscription_id}"
        await self.ask("DELETE", path, also=(404,))
