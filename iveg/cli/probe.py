"""The probe that ``iveg doctor`` creates at Orion and the agent, and its removal.

Each object is noted before its creation: a request that was cancelled or timed out may
have been executed all the same.
"""

import asyncio
from collections.abc import Awaitable

from iveg.adapters.iot_agent import (
    RESOURCE,
    IotAgentClient,
    write_device,
    write_group,
)
from iveg.adapters.orion import OrionClient
from iveg.domain.errors import HopError
from iveg.ngsi import names

PROBE_ID, PROBE_TYPE = names.DOCTOR_ID, names.HEARTBEAT_TYPE
DESCRIPTION = "iveg doctor"
"""Of the subscription.  Not ``iVeg: …``: a running iVeg removes others of that name."""
_ENTITY = f"/v2/entities/{PROBE_ID}"
_TYPE = {"type": PROBE_TYPE}


class Probe:
    """The probe's device, entity and subscription.

    Args:
        orion: Client of the context broker.
        agent: Client of the IoT Agent.
        apikey: First part of its topics.

    Attributes:
        left_behind: Objects that could not be removed, as sentences.
    """

    def __init__(self, orion: OrionClient, agent: IotAgentClient, apikey: str) -> None:
        self._orion = orion
        self._agent = agent
        self._apikey = apikey
        self._made_device = self._made_group = self._touched_orion = False
        self.left_behind: list[str] = []

    def topic(self, last: str) -> str:
        """A topic of the probe."""
        return f"/{self._apikey}/{PROBE_ID}/{last}"

    # --- making and using ---------------------------------------------------------

    async def make_device(self, orion_url: str) -> None:
        """Create the device, and its group where iVeg has never run.

        Raises:
            HopError: the agent refuses it.
        """
        self._made_device = self._touched_orion = True
        known = [one.get("apikey") for one in await self._agent.read_groups()]
        if self._apikey not in known:
            self._made_group = True
            await self._agent.create_group(write_group(self._apikey, orion_url))
        await self._agent.delete_device(PROBE_ID)
        device = write_device(
            PROBE_ID,
            PROBE_ID,
            PROBE_TYPE,
            (("probe", "object"),),
            self._apikey,
            has_command=True,
        )
        if not await self._agent.create_device(device):
            raise HopError("iot_agent", "says that there is such a device already")

    async def subscribe(self, url: str) -> str:
        """Subscribe at Orion to changes of the entity; returns the id.

        Raises:
            HopError: Orion does not take it.
        """
        self._touched_orion = True
        return await self._orion.create_subscription(_subscription(url))

    async def change(self, mark: str) -> None:
        """Change the entity at Orion directly, without the agent.

        The attribute differs from the measure's, which may still arrive.

        Raises:
            HopError: Orion does not take it.
        """
        attribute = {"type": "object", "value": {"mark": mark}}
        body = {"id": PROBE_ID, "type": PROBE_TYPE, "notified": attribute}
        query = {"options": "upsert"}
        await self._orion.ask("POST", "/v2/entities", query=query, body=body)

    async def command(self, mark: str) -> None:
        """Command it: ``cmd`` alone, with its type, or Orion drops it without an error.

        Raises:
            HopError: Orion does not take it.
        """
        command = {names.COMMAND: {"type": "command", "value": {"probe": mark}}}
        path = f"{_ENTITY}/attrs"
        await self._orion.ask("PATCH", path, query=_TYPE, body=command)

    async def holds(self, attribute: str, mark: str) -> bool:
        """Whether the attribute at Orion contains the mark.

        Raises:
            HopError: Orion does not answer.
        """
        query = {**_TYPE, "attrs": attribute, "options": "skipForwarding"}
        found = await self._orion.ask("GET", _ENTITY, query=query, also=(404,))
        return mark in found.text

    async def why_not_notified(self, subscription_id: str) -> str:
        """Orion's reason for an undelivered notification; empty if it gives none.

        Raises:
            HopError: Orion does not answer.
        """
        for one in await self._orion.read_subscriptions():
            if one.get("id") == subscription_id:
                notification = one.get("notification", {})
                if notification.get("lastFailureReason"):
                    return str(notification["lastFailureReason"])
                if notification.get("lastSuccess"):
                    return "Orion believes that it did; somebody else answers there"
        return ""

    # --- removing -----------------------------------------------------------------

    async def remove(self, within_s: float) -> None:
        """Remove everything, the device first, since it may still write.

        Args:
            within_s: Time limit in all (s); a server that does not answer gets half.
        """
        half = within_s / 2
        ends = asyncio.get_running_loop().time() + within_s
        if self._made_device:
            await self._try("device", self._agent.delete_device(PROBE_ID), half)
        if self._made_group:
            await self._try("group", self._delete_group(), half / 2)
        for what, removing in (
            ("subscription", self._delete_subscriptions),
            ("registration", self._delete_registrations),
            ("entity", self._delete_entities),
        ):
            if self._touched_orion:
                left = ends - asyncio.get_running_loop().time()
                await self._try(what, removing(), max(0.0, left))

    async def _try(
        self, what: str, removing: Awaitable[object], within_s: float
    ) -> None:
        try:
            async with asyncio.timeout(within_s):
                await removing
        except (HopError, TimeoutError) as error:
            why = str(error) or f"no answer in {within_s:.1f} s"
            self.left_behind.append(
                f"The {what} of {PROBE_ID} may be left behind ({why}); a running iVeg "
                "or the next `iveg doctor` removes it."
            )

    async def _delete_group(self) -> None:
        query = {"resource": RESOURCE, "apikey": self._apikey}
        path = "/iot/services"
        await self._agent.ask("DELETE", path, query=query, also=(404,))

    async def _delete_subscriptions(self) -> None:
        for one in await self._orion.read_subscriptions():
            if one.get("description") == DESCRIPTION:
                await self._orion.delete_subscription(one["id"])

    async def _delete_registrations(self) -> None:
        for one in await self._orion.read_registrations():
            entities = one.get("dataProvided", {}).get("entities", [])
            if any(entity.get("id") == PROBE_ID for entity in entities):
                await self._orion.delete_registration(one["id"])

    async def _delete_entities(self) -> None:
        """Entities of the probe, also one that the agent made from a late measure."""
        ids = [PROBE_ID, f"{names.ROBOT_TYPE}:{PROBE_ID}"]
        for entity_id, kind in await self._orion.find_entities(ids):
            await self._orion.delete_entity(entity_id, kind)


def _subscription(url: str) -> dict[str, object]:
    return {
        "description": DESCRIPTION,
        "subject": {
            "entities": [{"id": PROBE_ID, "type": PROBE_TYPE}],
            "condition": {"attrs": ["notified"]},
        },
        "notification": {"http": {"url": url}, "attrs": ["notified"]},
    }
