"""Robots that are connected just now, whose names a recording must not take."""

from collections.abc import Iterable

from iveg.adapters import clock
from iveg.app.fiware import open_fiware
from iveg.settings import Settings

_LIVE_S = 10.0


async def live_robot(settings: Settings, robots: Iterable[str]) -> str | None:
    """The first of these robots that Orion had data of in the last 10 s.

    Raises:
        HopError: Orion does not answer.
    """
    orion, agent = open_fiware(settings)
    async with orion, agent:
        for robot_id in robots:
            heard = await orion.modified_at(robot_id)
            if heard is not None and clock.wall() - heard < _LIVE_S:
                return robot_id
    return None
