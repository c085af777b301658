"""The adapter for Orion, for commands and for reading once after a gap.

Orion's 204 to a command proves nothing: it also answers so when the command went
nowhere (docs/fiware.md).  Who wants to know waits for the robot's own answer.
"""

import asyncio
import socket
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, Self

import httpx
import orjson

from iveg.domain.errors import HopError, NoAnswerError
from iveg.ngsi import names

_NODELAY = [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)]
_PAGE = 100
_TIMEOUT_S = 6.0
"""A little more than the five seconds that Orion waits for a hung agent."""
PROBE_TIMEOUT_S = 3.0
"""For a question that a healthy neighbour answers in milliseconds."""
_MOST_PAGES = 100
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
    *names.ALGORITHM_1,
)
"""What is read of a robot.  Never ``cmd``: Orion would go and ask the agent for it."""

Document = dict[str, Any]


class FiwareHttp:
    """HTTP to one FIWARE service: its headers, and failures as ``HopError``.

    Args:
        hop: Names the neighbour in errors.
        url: Address without a path.
        service: Tenant.
        path: Service path.
        bearer: Token that is sent along; empty for none.
    """

    def __init__(
        self, hop: str, url: str, service: str, path: str, bearer: str = ""
    ) -> None:
        self._hop = hop
        headers = {"Fiware-Service": service, "Fiware-ServicePath": path}
        if bearer:
            headers["Authorization"] = f"Bearer {bearer}"
        self._client = httpx.AsyncClient(
            base_url=url,
            headers=headers,
            timeout=_TIMEOUT_S,
            transport=httpx.AsyncHTTPTransport(socket_options=_NODELAY),
        )

    async def close(self) -> None:
        """Close the kept connections."""
        await self._client.aclose()

    async def ask(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        body: Any = None,
        timeout_s: float = _TIMEOUT_S,
        also: Sequence[int] = (),
    ) -> httpx.Response:
        """One request.

        Args:
            method: HTTP method.
            path: With a leading slash.
            query: Parameters.
            body: Sent as JSON unless None.
            timeout_s: For the whole exchange (s), however slowly it trickles.
            also: Statuses beside 2xx that the caller understands.

        Raises:
            NoAnswerError: no answer in time.
            HopError: no connection, or another status.
        """
        try:
            async with asyncio.timeout(timeout_s):
                response = await self._client.request(
                    method,
                    path,
                    params=dict(query or {}),
                    json=body,
                    headers={"Accept": "application/json"},
                    timeout=timeout_s,
                )
        except (TimeoutError, httpx.TimeoutException) as error:
            raise NoAnswerError(
                self._hop, f"no answer to {method} {path} in {timeout_s:g} s"
            ) from error
        except httpx.HTTPError as error:
            raise HopError(
                self._hop, f"cannot be reached: {str(error) or type(error).__name__}"
            ) from error
        if response.is_success or response.status_code in also:
            return response
        raise HopError(self._hop, _complaint(method, path, response))

    def read(self, response: httpx.Response) -> Any:
        """The JSON of an answer.

        Raises:
            HopError: it is not JSON.
        """
        try:
            return orjson.loads(response.content)
        except ValueError as error:
            raise HopError(self._hop, "answered something that is not JSON") from error

    def read_list(self, response: httpx.Response, part: str = "") -> list[Document]:
        """The list of objects in an answer, or in one part of it.

        Raises:
            HopError: it is anything else.
        """
        told = self.read(response)
        if part:
            told = told.get(part) if isinstance(told, dict) else None
        if not isinstance(told, list) or not all(isinstance(one, dict) for one in told):
            raise HopError(self._hop, "answered JSON that means nothing here")
        return told

    def read_count(self, text: Any) -> int:
        """How many there are in all, as the neighbour says it.

        Raises:
            HopError: it does not.
        """
        try:
            return int(text)
        except (TypeError, ValueError) as error:
            raise HopError(self._hop, f"counted {text!r} of something") from error


def _complaint(method: str, path: str, response: httpx.Response) -> str:
    """What a refusal says, short; Orion and the agent use different words."""
    said = ""
    try:
        told = orjson.loads(response.content)
    except ValueError:
        told = None
    if isinstance(told, dict):
        said = str(told.get("description") or told.get("message") or "")[:160]
    refused = f"{response.status_code} to {method} {path}"
    return f"{refused}: {said}" if said else refused


class OrionClient:
    """What iVeg asks of Orion.

    Args:
        url: Address of Orion, such as ``http://127.0.0.1:1026``.
        service: ``Fiware-Service``.
        path: ``Fiware-ServicePath``.
    """

    def __init__(self, url: str, service: str, path: str) -> None:
        self.http = FiwareHttp("orion", url, service, path)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the kept connections."""
        await self.http.close()

    async def version(self) -> str:
        """Orion's version.

        Raises:
            HopError: Orion does not answer.
        """
        told = self.http.read(await self.http.ask("GET", "/version"))
        about = told.get("orion", {}) if isinstance(told, dict) else {}
        return str(about.get("version", "unknown"))

    async def update_command(
        self, robot_id: str, value: Mapping[str, Any], timeout_s: float = 1.5
    ) -> None:
        """Ask Orion to pass a command on.

        ``cmd`` goes alone, with ``?type=Robot`` and as an update: anything else makes
        Orion store or lose it and still answer 204.  A return therefore proves
        nothing; an error may still mean that the command arrives later.

        Args:
            robot_id: The robot.
            value: The command (docs/interfaces/commands.md).
            timeout_s: How long Orion may take (s).

        Raises:
            HopError: Orion did not take it; 404 also means that the agent is away.
        """
        await self.http.ask(
            "PATCH",
            f"/v2/entities/{robot_id}/attrs",
            query={"type": names.ROBOT_TYPE},
            body={names.COMMAND: {"type": "command", "value": dict(value)}},
            timeout_s=timeout_s,
        )

    async def read_robots(self) -> list[dict[str, Any]]:
        """Every robot that Orion knows, as ``ngsi.codec.read_entity`` takes them.

        Raises:
            HopError: Orion does not answer.
        """
        return await self.read_entities(
            names.ROBOT_TYPE, ROBOT_ATTRIBUTES, options="skipForwarding"
        )

    async def read_entities(
        self, entity_type: str, attributes: Sequence[str], options: str = ""
    ) -> list[dict[str, Any]]:
        """Entities of a type, page by page.

        Raises:
            HopError: Orion does not answer.
        """
        asked = ",".join(part for part in (options, "count") if part)
        query = {"type": entity_type, "attrs": ",".join(attributes), "orderBy": "id"}
        return await self._all("/v2/entities", {**query, "options": asked})

    async def read_probe(self) -> Document | None:
        """The heartbeat probe as Orion has it; None where none ever came so far.

        Raises:
            HopError: Orion does not answer at once.
        """
        response = await self.http.ask(
            "GET",
            f"/v2/entities/{names.HEARTBEAT_ID}",
            query={"type": names.HEARTBEAT_TYPE, "attrs": "probe"},
            timeout_s=PROBE_TIMEOUT_S,
            also=(404,),
        )
        told = self.http.read(response)
        if not isinstance(told, dict):
            raise HopError("orion", "answered JSON that means nothing here")
        return None if response.status_code == 404 else told

    async def read_probe_times(self) -> tuple[float, float]:
        """When the newest heartbeat probe at Orion left iVeg, and when it came there.

        Returns:
            Seconds, Unix time, by iVeg's clock and by Orion's.

        Raises:
            HopError: Orion does not answer, or has none that tells.
        """
        response = await self.http.ask(
            "GET",
            f"/v2/entities/{names.HEARTBEAT_ID}",
            query={
                "type": names.HEARTBEAT_TYPE,
                "attrs": "probe",
                "metadata": "dateModified",
            },
            timeout_s=PROBE_TIMEOUT_S,
        )
        told = self.http.read(response)
        try:
            left = datetime.fromisoformat(told["probe"]["value"]["stamp"])
        except (KeyError, TypeError, ValueError) as error:
            raise HopError("orion", "has no probe of iVeg's") from error
        came = _date_modified(told, "probe")
        if came is None:
            raise HopError("orion", "does not tell when the probe came")
        return left.timestamp(), came

    async def find_entities(self, ids: Sequence[str]) -> list[tuple[str, str]]:
        """Id and type of those of these entities that Orion itself keeps.

        Raises:
            HopError: Orion does not answer.
        """
        query = {
            "id": ",".join(ids),
            "attrs": "dateCreated",
            "options": "keyValues,skipForwarding",
            "limit": str(_PAGE),
        }
        response = await self.http.ask("GET", "/v2/entities", query=query)
        found = self.http.read_list(response)
        return [(str(one["id"]), str(one["type"])) for one in found if one.get("id")]

    async def delete_entity(self, entity_id: str, entity_type: str) -> None:
        """Delete an entity; one that is gone already is no error.

        Raises:
            HopError: Orion does not answer.
        """
        path, query = f"/v2/entities/{entity_id}", {"type": entity_type}
        await self.http.ask("DELETE", path, query=query, also=(404,))

    async def modified_at(self, robot_id: str) -> float | None:
        """When Orion last changed a robot's odometry.

        Returns:
            Seconds, Unix time; None where there is none yet.

        Raises:
            HopError: Orion does not answer.
        """
        response = await self.http.ask(
            "GET",
            f"/v2/entities/{robot_id}",
            query={
                "type": names.ROBOT_TYPE,
                "attrs": names.ODOMETRY,
                "metadata": "dateModified",
                "options": "skipForwarding",
            },
            also=(404,),
        )
        if response.status_code == 404:
            return None
        return _date_modified(self.http.read(response), names.ODOMETRY)

    async def delete_attribute(self, robot_id: str, name: str) -> bool:
        """Delete an attribute of a robot; whether there was one.

        Raises:
            HopError: Orion does not answer.
        """
        response = await self.http.ask(
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
        response = await self.http.ask(
            "GET",
            f"/v2/entities/{robot_id}",
            query={
                "type": names.ROBOT_TYPE,
                "attrs": name,
                "options": "skipForwarding",
            },
            also=(404,),
        )
        if response.status_code == 404:
            return False
        told = self.http.read(response)
        return isinstance(told, dict) and name in told

    async def read_registrations(self) -> list[dict[str, Any]]:
        """Every registration of our tenant.

        Raises:
            HopError: Orion does not answer.
        """
        return await self._all("/v2/registrations")

    async def delete_registration(self, registration_id: str) -> None:
        """Delete a registration; one that is gone already is no error.

        Raises:
            HopError: Orion does not answer.
        """
        path = f"/v2/registrations/{registration_id}"
        await self.http.ask("DELETE", path, also=(404,))

    async def read_subscriptions(self) -> list[dict[str, Any]]:
        """Every subscription of our tenant.

        Raises:
            HopError: Orion does not answer.
        """
        return await self._all("/v2/subscriptions")

    async def create_subscription(self, document: Mapping[str, Any]) -> str:
        """Subscribe; the id of the subscription.

        Raises:
            HopError: Orion does not take it.
        """
        response = await self.http.ask("POST", "/v2/subscriptions", body=dict(document))
        made = str(response.headers.get("Location", "").rpartition("/")[2])
        if not made:
            raise HopError("orion", "took a subscription and did not say where it is")
        return made

    async def update_subscription(
        self, subscription_id: str, changes: Mapping[str, Any]
    ) -> None:
        """Change a subscription; each part that is named replaces the old one whole.

        Raises:
            HopError: Orion does not take it.
        """
        path = f"/v2/subscriptions/{subscription_id}"
        await self.http.ask("PATCH", path, body=dict(changes))

    async def delete_subscription(self, subscription_id: str) -> None:
        """Delete a subscription; one that is gone already is no error.

        Raises:
            HopError: Orion does not answer.
        """
        path = f"/v2/subscriptions/{subscription_id}"
        await self.http.ask("DELETE", path, also=(404,))

    async def _all(
        self, path: str, query: Mapping[str, str] | None = None
    ) -> list[Document]:
        """Page by page; a neighbour that never comes to an end is left."""
        found: list[Document] = []
        query = query or {"options": "count"}
        for _ in range(_MOST_PAGES):
            page = {**query, "limit": str(_PAGE), "offset": str(len(found))}
            response = await self.http.ask("GET", path, query=page)
            told = self.http.read_list(response)
            found += told
            total = self.http.read_count(response.headers.get("Fiware-Total-Count", 0))
            if not told or len(found) >= total:
                break
        return found


def _date_modified(entity: Any, attribute: str) -> float | None:
    try:
        text = entity[attribute]["metadata"]["dateModified"]["value"]
        return datetime.fromisoformat(text).timestamp()
    except (KeyError, TypeError, ValueError):
        return None
