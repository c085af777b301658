"""Requests to Orion: commands, entities, subscriptions.

Orion's 204 to a command proves nothing: Orion also answers so when the command reached
nobody (docs/fiware.md).  The evidence is the robot's own answer.
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

SUBSCRIPTIONS, REGISTRATIONS = "/v2/subscriptions", "/v2/registrations"
ROBOTS = {"type": names.ROBOT_TYPE}
"""Query for entities of robots alone."""
_COMMAND_TIMEOUT_S = 1.5
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
"""Attributes of a robot that are read.  Never ``cmd`` or ``goal``: for them Orion would
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
        name: str = names.COMMAND,
    ) -> None:
        """Ask Orion to pass a command on.

        ``cmd`` goes alone, with ``?type=Robot`` and as an update: else Orion stores or
        loses it and still answers 204.  A return therefore proves
        nothing; an error may still mean that the command arrives later.

        Args:
            robot_id: The robot.
            value: The command (docs/interfaces/commands.md).
            name: Name of the NGSI command.

        Raises:
            HopError: Orion did not take it; 404 also means that the agent is away.
        """
        await self.ask(
            "PATCH",
            f"/v2/entities/{robot_id}/attrs",
            query=ROBOTS,
            body={name: {"type": "command", "value": dict(value)}},
            timeout_s=_COMMAND_TIMEOUT_S,
        )

    async def read_robots(self) -> list[Document]:
        """Every robot that Orion knows, as ``ngsi.codec.read_entity`` takes them.

        Raises:
            HopError: Orion does not answer.
        """
        query = ROBOTS | {
            "attrs": ",".join(ROBOT_ATTRIBUTES),
            "orderBy": "id",
            "options": "skipForwarding",
        }
        return await self.read_all("/v2/entities", query)

    async def read_probe(self) -> Document | None:
        """The heartbeat probe as Orion has it; None where none has ever arrived.

        Raises:
            HopError: Orion does not answer at once.
        """
        return await self._read_entity(
            names.HEARTBEAT_ID,
            {"type": names.HEARTBEAT_TYPE, "attrs": "probe"},
            PROBE_TIMEOUT_S,
        )

    async def has_attribute(self, robot_id: str, name: str) -> bool:
        """Whether Orion itself keeps an attribute of a robot.

        Raises:
            HopError: Orion does not answer.
        """
        # Else Orion would answer with the attribute of the agent's registration.
        query = ROBOTS | {"attrs": name, "options": "skipForwarding"}
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

    async def create_subscription(self, document: Document) -> str:
        """Make a subscription; returns its id.

        Raises:
            HopError: Orion refuses it.
        """
        response = await self.ask("POST", SUBSCRIPTIONS, body=document)
        made = str(response.headers.get("Location", "").rpartition("/")[2])
        if not made:
            raise HopError("orion", "took a subscription and did not say where it is")
        return made
