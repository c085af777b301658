"""Stray entities that an agent made for unknown devices, and their removal.

A measure of an unknown device makes an entity ``{type}:{device_id}``, such as
``Robot:AGI_odom``: that happened while an agent with its registry in memory had
forgotten our devices, and after a doctor whose measure came when its device was gone.
Our group forbids that now (``autoprovision``); existing strays are removed here.
"""

from collections.abc import Iterable, Mapping

from iveg.adapters.fiware_http import Document
from iveg.adapters.orion import OrionClient
from iveg.ngsi import names

_AT_ONCE = 50
"""Ids in one question: an address has a longest length."""


async def remove_orphans(
    orion: OrionClient, devices: Mapping[str, Document], robots: Iterable[str]
) -> list[str]:
    """Remove the entities that no device of ours feeds; says which.

    Args:
        orion: Where they are.
        devices: The agent's devices, by id, as they are now.
        robots: The fleet.

    Raises:
        HopError: Orion does not answer.
    """
    fed = {str(one.get("entity_name")) for one in devices.values()}
    strays = [one for one in _candidates(robots) if one not in fed]
    removed = []
    for start in range(0, len(strays), _AT_ONCE):
        for entity_id, kind in await orion.find_entities(strays[start:][:_AT_ONCE]):
            await orion.delete_entity(entity_id, kind)
            removed.append(
                f"Removed entity {entity_id}, which no device of ours feeds."
            )
    return removed


def _candidates(robots: Iterable[str]) -> list[str]:
    """Every name that an agent could have made up from our devices' ids."""
    ids = [robot + device.suffix for robot in robots for device in names.ROBOT_DEVICES]
    ids += [names.CLIMATE_DEVICE, names.HEARTBEAT_ID, names.DOCTOR_ID]
    return [names.DOCTOR_ID, *(f"{names.ROBOT_TYPE}:{one}" for one in ids)]
