"""Robots that are connected just now, whose names a recording must not take."""

from collections.abc import Iterable

from iveg.adapters import clock
from iveg.adapters.orion import OrionClient
from iveg.settings import Settings

_LIVE_S = 10.0


async def live_robot(settings: Settings, robots: Iterable[str]) -> str | None:
    """The first of these robots that Orion had data of in the last 10 s.

    Raises:
        HopError: Orion does not answer.
    """
    tenant = settings.fiware_service, settings.fiware_servicepath
    async with OrionClient(settings.orion_url, *tenant) as orion:
        for robot_id in robots:
            heard = await orion.modified_at(robot_id)
            if heard is not None and clock.wall() - heard < _LIVE_S:
                return robot_id
    return None
